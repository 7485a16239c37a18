"""The loads for which contact lines are solved: beyond them nothing is modelled."""

from __future__ import annotations

from math import inf

from gearbench.bench.errors import BenchError
from gearbench.fem.limits import EDGE_SEPARATION, LOAD_RANGE, elastic_pair
from gearbench.geometry import Pair
from gearbench.rig import Case


def largest_torque(meshing: Pair) -> float:
    """Largest driver torque [N m] that the modelled flanks can carry."""
    return float(LOAD_RANGE[1] * meshing.face_width * meshing.driver.base_radius)


def check_mean_torque(case: Case) -> None:
    """Raise BenchError for a mean torque of a case beyond the modelled loads."""
    if case.stated:
        check_torque(elastic_pair(case.rig), case.experiment.torque_mean, "experiment.torque_mean_nm")


def check_torque(meshing: Pair, torque: float, key: str) -> None:
    """Raise BenchError for a driver torque [N m] beyond the modelled loads; `key` is what the user called it."""
    most = largest_torque(meshing)
    if not torque <= most:
        raise BenchError(f"{key} = {torque:g} is more than the modelled flanks can carry: at most {most:.4g}")


def check_dte(meshing: Pair, dte: float, key: str, most: float = inf) -> None:
    """Raise BenchError for a transmission error [m] beyond the reach of contact off the line of action, or beyond
    `most` [m]."""
    most = min(most, EDGE_SEPARATION * meshing.driver.module)
    if not dte <= most:
        raise BenchError(
            f"{key} = {dte * 1e6:g} presses the flanks further than they are modelled: at most {most * 1e6:.4g}"
        )
