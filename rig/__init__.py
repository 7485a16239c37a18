"""What is tested: gears, rig, experiment and case, as immutable SI values.

`casefile`: cases from and to TOML, where units meet; the values themselves lie on top, one idea a file.
"""

from gearbench.rig.casefile.case import Case, CaseError, dump_case, read_case
from gearbench.rig.drive import Coupling, Drive, Load, OutputShaft, Ripple
from gearbench.rig.experiment import Condition, Experiment, Identification, Multisine, Simulation, SpeedTable
from gearbench.rig.gear import Crack, Gear
from gearbench.rig.mesh import Friction, MeshCorrection
from gearbench.rig.neutral import effects_in, sound_gear
from gearbench.rig.rig import Damping, Material, Rig
from gearbench.rig.sensors import Sensors
from gearbench.rig.study import Study
from gearbench.rig.support import Across, Housing, Rocking, Support, Supports

__all__ = [
    "Across",
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
    "Housing",
    "Identification",
    "Load",
    "Material",
    "MeshCorrection",
    "Multisine",
    "OutputShaft",
    "Rig",
    "Ripple",
    "Rocking",
    "Sensors",
    "Simulation",
    "SpeedTable",
    "Study",
    "Support",
    "Supports",
    "dump_case",
    "effects_in",
    "read_case",
    "sound_gear",
]
