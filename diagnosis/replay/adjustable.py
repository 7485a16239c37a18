"""Numbers of a rig that may be moved: how to read and set one, how far it is uncertain, where its limits are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import simulated_channels
from gearbench.rig import Case

Array = NDArray[np.float64]
Simulate = Callable[[Case, xr.Dataset], xr.Dataset]


@dataclass(frozen=True)
class Adjustable:
    """One number of a case, SI. `get(case)`, `set(case, value)` (raises ValueError for a value that no rig may have).

    Prior: Gaussian around `mean` (None: what the case at hand holds) with standard deviation `sd`; bounds `low`,
    `high`.
    """

    name: str
    get: Callable[[Case], float]
    set: Callable[[Case, float], Case]
    sd: float
    mean: float | None = None
    low: float = -np.inf
    high: float = np.inf

    def __post_init__(self) -> None:
        if not (isfinite(self.sd) and self.sd > 0):
            raise DiagnosisError(f"{self.name}: sd = {self.sd:g} must be positive and finite")
        if not self.low < self.high:
            raise DiagnosisError(f"{self.name}: low = {self.low:g} must be less than high = {self.high:g}")


def at_path(
    path: str, sd: float, *, mean: float | None = None, low: float = -np.inf, high: float = np.inf
) -> Adjustable:
    """The number at a dotted path of fields from the case on ("rig.support.driver.stiffness"); whole numbers in the
    path count the items of tuples ("rig.driver.pitch_error.3"). Setting validates as reading a case file does."""
    parts = path.split(".")
    return Adjustable(
        path, lambda case: float(_get(case, parts)), lambda case, value: _set(case, parts, value), sd, mean, low, high
    )


def uncertain(case: Case) -> tuple[Adjustable, ...]:
    """The numbers of the rig that the case gives with a standard deviation; those of experiments are left alone."""
    return tuple(at_path(path, sd) for path, sd in case.uncertainty.items() if path.startswith("rig.") and sd > 0)


def variants(
    nominal: Case,
    measurements: Sequence[Measurement],
    parameters: Sequence[Adjustable],
    simulate: Simulate,
) -> list[list[Mapping[str, Array]]]:
    """For each parameter, moved up by one standard deviation (down where up is no rig), the replays of all
    measurements as `signals.simulated_channels`: what `budget` takes as `variants`."""
    found: list[list[Mapping[str, Array]]] = []
    for parameter in parameters:
        value = parameter.get(nominal)
        moved = _moved(nominal, parameter, (value + parameter.sd, value - parameter.sd))
        found.append([simulated_channels(one, simulate(moved, one.record)) for one in measurements])
    return found


def _moved(case: Case, parameter: Adjustable, values: Sequence[float]) -> Case:
    for value in values:
        if parameter.low <= value <= parameter.high:
            try:
                return parameter.set(case, value)
            except ValueError:
                continue
    raise DiagnosisError(
        f"{parameter.name} = {parameter.get(case):g} can be moved by its sd = {parameter.sd:g} neither up nor down"
    )


def _get(value: Any, parts: Sequence[str]) -> Any:
    for part in parts:
        value = value[int(part)] if isinstance(value, tuple) else getattr(value, part, None)
        if value is None:
            raise DiagnosisError(f"the case has no number at {'.'.join(parts)}")
    return value


def _set(value: Any, parts: Sequence[str], number: float) -> Any:
    if not parts:
        return number
    first, rest = parts[0], parts[1:]
    if isinstance(value, tuple):
        index = int(first)
        return (*value[:index], _set(value[index], rest, number), *value[index + 1 :])
    inner = getattr(value, first, None)
    if inner is None:
        raise DiagnosisError(f"the case has no number at {first}, so it cannot be set to {number:g}")
    return type(value).model_validate({**dict(value), first: _set(inner, rest, number)})
