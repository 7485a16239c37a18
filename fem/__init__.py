"""Finite elements: elastic gears condensed to hub and flanks, their contact, and the reduced rig in motion.

`gear`: plane elasticity of a tooth sector, the ring of sectors, condensation. `contact`: kinematics of real flanks,
flank kernels, contact lines, the contact law of a pair, statics with hub centres held. `motion`: equations of motion of
the reduced rig and their time integration. `full`: the same with every unknown of both gears. `stress`:
fields inside loaded gears, root stress. Loads Numba.
"""

from gearbench.fem.contact.law import Law, elastic_pair, make_law
from gearbench.fem.contact.static import ContactError, StaticCycle, static_cycle
from gearbench.fem.gear.body import CondensedGear, condense

__all__ = [
    "CondensedGear",
    "ContactError",
    "Law",
    "StaticCycle",
    "condense",
    "elastic_pair",
    "make_law",
    "static_cycle",
]
