"""What a record alone can tell about itself: refused in a sentence, or warned of where it can be right."""

from gearbench.records.checks.angles import angles_follow_mesh_phase, angles_keep_mesh_period
from gearbench.records.checks.clipping import clipped_channels
from gearbench.records.checks.copies import same_samples
from gearbench.records.checks.door import CHECKS, check_record
from gearbench.records.checks.periods import periods_repeat
from gearbench.records.checks.run_out import shafts_turn_true
from gearbench.records.seen.finding import ANGLE_UNITS, TORQUE_UNITS, Finding, unit_hint
from gearbench.records.seen.look import mean_speed

__all__ = [
    "ANGLE_UNITS",
    "CHECKS",
    "TORQUE_UNITS",
    "Finding",
    "angles_follow_mesh_phase",
    "angles_keep_mesh_period",
    "check_record",
    "clipped_channels",
    "mean_speed",
    "periods_repeat",
    "same_samples",
    "shafts_turn_true",
    "unit_hint",
]
