"""The loads for which contact lines are solved: beyond them nothing is modelled."""

from __future__ import annotations

from math import inf

from gearbench.bench.errors import BenchError
from gearbench.fem.contact.curve import EDGE_SEPARATION, LOAD_RANGE
from gearbench.geometry import Pair


def check_torque(meshing: Pair, torque: float, key: str) -> None:
    """Raise BenchError for a driver torque [N m] beyond the modelled loads; `key` is what the user called it."""
    most = LOAD_RANGE[1] * meshing.face_width * meshing.driver.base_radius
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
