"""What is tested: gears, rig, experiment and case, as immutable SI values."""

from gearbench.rig.case import Case, CaseError, dump_case, read_case
from gearbench.rig.experiment import Condition, Experiment, Identification, Multisine, Simulation
from gearbench.rig.gear import Gear
from gearbench.rig.rig import Damping, Drive, Load, Material, Rig, Support, Supports

__all__ = [
    "Case",
    "CaseError",
    "Condition",
    "Damping",
    "Drive",
    "Experiment",
    "Gear",
    "Identification",
    "Load",
    "Material",
    "Multisine",
    "Rig",
    "Simulation",
    "Support",
    "Supports",
    "dump_case",
    "read_case",
]
