"""Finite elements: elastic gears condensed to hub and flanks, their contact, and the reduced rig in motion.

`gear`: plane elasticity of a tooth sector, the ring of sectors, condensation. `contact`: kinematics of real flanks,
flank kernels, contact lines, the contact law of a pair, statics with hub centres held. `motion`: equations of motion of
the reduced rig and their time integration. `full`: the same with every unknown of both gears. `stress`:
fields inside loaded gears, root stress. `limits`: what may be asked of them. All but that loads Numba.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearbench.files import names_on_use

if TYPE_CHECKING:
    from gearbench.fem.contact.law import Law, make_law
    from gearbench.fem.contact.static import ContactError, StaticCycle, static_cycle
    from gearbench.fem.gear.body import CondensedGear, condense
    from gearbench.fem.limits import elastic_pair

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

_HOMES = {
    "CondensedGear": "gearbench.fem.gear.body",
    "ContactError": "gearbench.fem.contact.static",
    "Law": "gearbench.fem.contact.law",
    "StaticCycle": "gearbench.fem.contact.static",
    "condense": "gearbench.fem.gear.body",
    "elastic_pair": "gearbench.fem.limits",
    "make_law": "gearbench.fem.contact.law",
    "static_cycle": "gearbench.fem.contact.static",
}

# Imported on use: `check` asks for limits only, and elements and Numba take seconds to load.
__getattr__ = names_on_use(__name__, _HOMES)
