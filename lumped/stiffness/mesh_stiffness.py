"""Mesh stiffness k over the mesh phase [cycles]: potential energy, rectangular, or tabulated.

Phase 0 is the instant when driver tooth 0 touches at the pitch point; k repeats after one cycle. A tooth
pair works between its first and its last point of contact; there it joins or leaves either at once (edge
0, the classical assumption) or along a raised cosine of width `edge` [cycles], centred on the geometric
switch: loaded teeth bend, meet a little early and part a little late, so the load does not jump.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.geometry import Pair
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.stiffness.potential_energy import pair_stiffness
from gearbench.rig import Rig, Simulation

Array = NDArray[np.float64]

# Contact points along the path of contact of one tooth pair.
PAIR_POINTS = 1025


@dataclass(frozen=True)
class PairStiffness:
    """k(phase) = base + sum over tooth pairs i of window(phase - i) pair(phase - i).

    `pair_phase` (n,) rises from the first to the last contact of a pair (its own phase, 0 at the pitch
    point), `pair_value` (n,) [N/m] belongs to it; `base` [N/m] is there always; `edge` [cycles] is the
    width of the switches.
    """

    pair_phase: Array
    pair_value: Array
    base: float = 0.0
    edge: float = 0.0

    def at(self, phase: ArrayLike, *, finest: float = 0.0) -> Array:
        """k [N/m] at `phase` [cycles] (any shape); switches narrower than `finest` [cycles] are widened
        to it.

        A sampled k needs `finest`: where a switch falls between two samples would else be lost.
        """
        phase = np.asarray(phase, dtype=float)
        width = max(self.edge, finest)
        first, last = float(self.pair_phase[0]), float(self.pair_phase[-1])
        total = np.full(phase.shape, self.base)
        cycle = phase - np.floor(phase)
        for tooth in range(floor(-last - width), ceil(1 - first + width) + 1):
            own = cycle - tooth
            weight = _switch(own - first, width) * _switch(last - own, width)
            total += weight * np.interp(own, self.pair_phase, self.pair_value)
        return total

    def pairs(self, phase: ArrayLike) -> NDArray[np.int64]:
        """Number of tooth pairs between their first and last geometric contact at `phase`."""
        cycle = np.mod(np.asarray(phase, dtype=float), 1.0)
        first, last = float(self.pair_phase[0]), float(self.pair_phase[-1])
        return (np.floor(cycle - first) - np.ceil(cycle - last) + 1).astype(np.int64)

    @property
    def switches(self) -> tuple[float, float]:
        """Phases [0, 1) where a pair joins and where one leaves."""
        return float(self.pair_phase[0]) % 1.0, float(self.pair_phase[-1]) % 1.0


@dataclass(frozen=True)
class TabulatedStiffness:
    """k given by values (n,) [N/m] on the uniform phases 0, 1/n, ..., joined by straight lines."""

    values: Array

    def at(self, phase: ArrayLike, *, finest: float = 0.0) -> Array:
        """k [N/m] at `phase` [cycles] (any shape); `finest` has no effect on a table."""
        grid = np.arange(self.values.size + 1) / self.values.size
        closed = np.append(self.values, self.values[0])
        return np.interp(np.mod(np.asarray(phase, dtype=float), 1.0), grid, closed)


MeshStiffness = PairStiffness | TabulatedStiffness


def _switch(distance: Array, width: float) -> Array:
    """0 before, 1 behind the switch at distance 0; a raised cosine of that width between."""
    if width == 0.0:
        return (distance >= 0.0).astype(float)
    return 0.5 * (1 + np.sin(np.pi * np.clip(distance / width, -0.5, 0.5)))


def potential_energy_stiffness(rig: Rig, meshing: Pair, *, edge: float = 0.0) -> PairStiffness:
    """k by the potential energy method over the true profiles of the pair."""
    rho = np.linspace(*meshing.active_driver, PAIR_POINTS)
    phase = (rho - meshing.rho_pitch[0]) / meshing.base_pitch
    return PairStiffness(phase, pair_stiffness(rig, meshing, rho), edge=edge)


def rectangular_stiffness(meshing: Pair, single: float, double: float, *, edge: float = 0.0) -> PairStiffness:
    """`single` and `double` [N/m] with one and two pairs in contact; each further pair adds as much."""
    if not 0.0 < single < double:
        raise LumpedError(
            f"stiffness_single_n_per_m = {single:g} must be positive and below"
            f" stiffness_double_n_per_m = {double:g}"
        )
    limits = np.array(meshing.active_driver)
    phase = (limits - meshing.rho_pitch[0]) / meshing.base_pitch
    return PairStiffness(phase, np.full(2, double - single), base=2 * single - double, edge=edge)


def tabulated_stiffness(values: ArrayLike) -> TabulatedStiffness:
    """k from values [N/m] on uniform phases over one cycle, such as a finite-element result."""
    table = np.array(values, dtype=float)
    if table.ndim != 1 or table.size < 2:
        raise LumpedError(f"a stiffness table has shape {table.shape}: one dimension, at least 2 values")
    if not (np.isfinite(table).all() and (table > 0).all()):
        raise LumpedError(f"a stiffness table must be positive and finite; its lowest is {table.min():g} N/m")
    table.setflags(write=False)
    return TabulatedStiffness(table)


def mesh_stiffness(rig: Rig, meshing: Pair, simulation: Simulation) -> PairStiffness:
    """k(phase) as the case asks for it."""
    edge = simulation.stiffness_edge
    if simulation.mesh_stiffness == "potential-energy":
        return potential_energy_stiffness(rig, meshing, edge=edge)
    single, double = simulation.stiffness_single, simulation.stiffness_double
    if single is None or double is None:
        raise LumpedError(
            "a rectangular mesh stiffness needs stiffness_single_n_per_m and stiffness_double_n_per_m"
        )
    return rectangular_stiffness(meshing, single, double, edge=edge)
