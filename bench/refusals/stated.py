"""What needs an experiment refuses a case without one."""

from __future__ import annotations

from gearbench.bench.errors import BenchError
from gearbench.rig import Case


def check_stated(case: Case, what: str) -> None:
    """Raise BenchError for a case without experiment; `what` needs it."""
    if not case.stated and not case.conditions:
        raise BenchError(
            f"experiment is missing: {what} needs the table [experiment] with mesh_frequency_hz or speed_driver_rpm and"
            " torque_mean_nm"
        )


def check_springs(case: Case, what: str) -> None:
    """Raise BenchError for rigid supports; `what` needs to know how stiff they are."""
    for side in ("driver", "driven"):
        if getattr(case.rig.support, side).stiffness is None:
            raise BenchError(f"rig.support.{side}.stiffness_n_per_m is missing: {what} needs to know how stiff it is")


def mean_torque(case: Case) -> float:
    """The experiment's mean driver torque [N m]. Raises BenchError for a case without experiment."""
    if not case.stated:
        raise BenchError("experiment.torque_mean_nm is missing: give the load itself (--torque-nm or --dte-um)")
    return case.experiment.torque_mean
