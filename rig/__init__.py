"""What is tested: gears, rig, experiment and case, as immutable SI values.

`casefile`: cases from and to TOML, where units meet; the values themselves lie on top, one idea a file.
"""

from gearbench.rig.casefile.case import Case, CaseError, dump_case, read_case
from gearbench.rig.drive import Coupling, Drive, Ripple
from gearbench.rig.experiment import Condition, Experiment, Identification, Multisine, Simulation
from gearbench.rig.gear import Crack, Gear
from gearbench.rig.mesh import Friction, MeshCorrection
from gearbench.rig.neutral import effects_in, sound_gear
from gearbench.rig.rig import Damping, Load, Material, Rig, Support, Supports
from gearbench.rig.sensors import Sensors

__all__ = [
    "Case",
    "CaseError",
    "Condition",
    "Coupling",
    "Crack",
    "Damping",
    "Drive",
    "Experiment",
    "Friction",
    "Gear",
    "Identification",
    "Load",
    "Material",
    "MeshCorrection",
    "Multisine",
    "Rig",
    "Ripple",
    "Sensors",
    "Simulation",
    "Support",
    "Supports",
    "dump_case",
    "effects_in",
    "read_case",
    "sound_gear",
]
