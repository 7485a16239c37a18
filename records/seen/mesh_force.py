"""The mesh force as each gear and each support feels it: four accounts of one force.

    F1 = (T1 - J1 theta1'') / rb1      F2 = (T2 + J2 theta2'') / rb2      (Newton's second law of each gear)
    f F = -(k1 + c1 d/dt + m1 d^2/dt^2) y1 = (k2 + c2 d/dt + m2 d^2/dt^2) y2       (supports; k, c, m unknown)

They hold line by line whatever mesh and excitation are, so that they tell channels apart that contradict one another.
A rotor behind a soft coupling, ripple of the drive, or strong noise break them too: nothing is concluded from accounts
that disagree, only from those that agree once one channel is taken for what it is suspected to be.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.look import GEARS, Complexes, Look

Array = NDArray[np.float64]

# Signs by which the mesh force acts on y (docs/physics.md, "Axes, signs, zeros").
SIGNS = {"driver": -1.0, "driven": 1.0}
# Accounts of the force agree when their misfit is below AGREE, and a suspicion is taken for true when under it they
# agree and misfit by EXPLAINED times less than without.
AGREE, EXPLAINED = 0.25, 1 / 3
# Motion of a centre, over that of the flanks, below which it is held: what moves there is a rigid support.
# A y that is recorded 1e6 times too small is above it.
STILL = 1e-7
NOTHING = 1e-300  # N; accounts of no force agree


@dataclass(frozen=True, eq=False)
class Accounts:
    """`gears`: gear -> channel -> its part (lines,) of the force [N]; `centres`: gear -> y, its rate and acceleration
    (lines, 3) [m, m/s, m/s^2]; `omega` (lines,) [rad/s]."""

    gears: dict[str, dict[str, Complexes]]
    centres: dict[str, Complexes]
    omega: Array

    def relations(self) -> list[tuple[str, str]]:
        """Pairs of accounts: gear against gear, and gear against centre ("y_driver")."""
        pairs = [("driver", "driven")] if len(self.gears) == 2 else []
        return pairs + [(gear, f"y_{centre}") for gear in self.gears for centre in self.centres]

    def channels(self, relation: tuple[str, str]) -> set[str]:
        """Channels that a relation rests on."""
        first, second = relation
        return {*self.gears[first], *self.gears.get(second, {second: None})}

    def misfit(
        self, relation: tuple[str, str], channels: frozenset[str] = frozenset(), turn: Complexes | None = None
    ) -> Array:
        """Disagreement (D,) of two accounts relative to their rms, `channels` multiplied by `turn` (D, lines) before.

        Gear against gear: |F1 - F2| over the mean of both. Gear against centre: what the best k, c, m leave of F.
        """
        turn = np.ones((1, self.omega.size), dtype=complex) if turn is None else turn
        first = self._parts(relation[0], channels)
        if relation[1] in self.gears:
            second = self._parts(relation[1], channels)
            scale = 0.5 * (_size(first, turn) + _size(second, turn))
            return _size(first - second, turn) / np.maximum(scale, NOTHING)
        gear = relation[1].removeprefix("y_")
        basis = self._bases[gear]
        if relation[1] in channels:  # a turned y is a force turned the other way: Re(turn* F b*) = Re(turn F* b)
            inside = (first[1] @ basis).real + (turn @ (first[0][:, None] * basis).conj()).real
        else:
            inside = (first[0] @ basis).real + (turn @ (first[1][:, None] * basis)).real
        total = _size(first, turn)
        return np.asarray(np.sqrt(np.maximum(total**2 - (inside**2).sum(axis=1), 0.0)) / np.maximum(total, NOTHING))

    @cached_property
    def worst(self) -> float:
        """The largest misfit of all relations."""
        return max(float(self.misfit(relation)[0]) for relation in self.relations())

    def support(self, gear: str, centre: str) -> tuple[Array, Array, float]:
        """k, c, m (3,) of a centre's support [N/m, N s/m, kg] by least squares, the part of the force's rms that each
        explains (3,), and what they leave of it."""
        found, scale, left, whole = _fit(self.force(gear), self._columns(centre))
        return found, np.abs(found) * scale / whole, left

    def balance(self, gear: str, centre: str) -> tuple[float, float, float]:
        """The factor of a gear's acceleration with which it and the torque drive a centre's support best; relative to
        the force that they make with it the acceleration's part, and what is left."""
        torque, acceleration = self.gears[gear][f"torque_{gear}"], self.gears[gear][f"angle_{gear}"]
        found, scale, left, whole = _fit(torque, np.column_stack([-acceleration, self._columns(centre)]))
        force = max(float(np.linalg.norm(torque + found[0] * acceleration)), NOTHING)
        return float(found[0]), float(abs(found[0]) * scale[0]) / force, left * whole / force

    def force(self, gear: str) -> Complexes:
        """Force (lines,) [N] on the mesh as a gear has it."""
        return np.asarray(sum(self.gears[gear].values()))

    def _parts(self, gear: str, channels: frozenset[str]) -> Complexes:
        """Force (2, lines) of a gear without some channels, and what those make of it."""
        out = np.zeros((2, self.omega.size), dtype=complex)
        for name, part in self.gears[gear].items():
            out[int(name in channels)] += part
        return out

    @cached_property
    def _bases(self) -> dict[str, Complexes]:
        """Centre -> what its support may answer, conjugate and orthonormal: it does not depend on what is turned."""
        return {centre: _orthonormal(self._columns(centre)).conj() for centre in self.centres}

    def _columns(self, centre: str) -> Complexes:
        return SIGNS[centre] * self.centres[centre]


def explains(before: float, after: float) -> bool:
    """Whether a suspicion that turns one misfit into another is to be believed."""
    return after < AGREE and after < EXPLAINED * before


def accounts_of(look: Look) -> Accounts | None:
    """The accounts that a record allows; None where there are not two of them."""
    held = look.record.attrs.get("driven_boundary") == "speed"
    gears: dict[str, dict[str, Complexes]] = {}
    for gear, sign in zip(GEARS, (1.0, -1.0), strict=True):
        torque, swing = look.channel(f"torque_{gear}"), look.swing(gear)
        radius, inertia = look.number(f"base_radius_{gear}"), look.number(f"inertia_{gear}")
        if torque is None or radius is None:
            continue
        parts = {f"torque_{gear}": look.spectrum(torque) / radius}
        if swing is not None and inertia is not None:
            parts[f"angle_{gear}"] = -sign * inertia / radius * look.spectrum(swing, derivative=2)
        elif not (held and gear == "driven"):  # a gear that turns steadily needs no inertia
            continue
        if any(np.any(part) for part in parts.values()):
            gears[gear] = parts
    turned = [_turned(look, gear) for gear in GEARS]
    centres = {}
    for gear in GEARS:
        y = look.channel(f"y_{gear}")
        if y is not None and np.ptp(y) > STILL * max(turned):
            centres[gear] = np.stack([look.spectrum(y, derivative) for derivative in range(3)], axis=1)
    accounts = Accounts(gears, centres, look.omega)
    return accounts if accounts.relations() else None


def _fit(target: Complexes, columns: Complexes) -> tuple[Array, Array, float, float]:
    """Real factors (C,) of columns (lines, C) by least squares, the columns' norms, what they leave of the target
    (lines,) and the target's norm."""
    stacked, wanted = np.vstack([columns.real, columns.imag]), np.concatenate([target.real, target.imag])
    scale = np.maximum(np.linalg.norm(stacked, axis=0), np.finfo(float).tiny)
    found = np.linalg.lstsq(stacked / scale, wanted, rcond=None)[0]
    whole = max(float(np.linalg.norm(wanted)), NOTHING)
    return found / scale, scale, float(np.linalg.norm(wanted - stacked / scale @ found)) / whole, whole


def _turned(look: Look, gear: str) -> float:
    """How far the flanks of a gear swing with its rotation [m]; 0 where that is not known."""
    swing, radius = look.swing(gear), look.number(f"base_radius_{gear}")
    return 0.0 if swing is None or radius is None else float(np.ptp(swing)) * radius


def _size(parts: Complexes, turn: Complexes) -> Array:
    """Norms (D,) of parts[0] + turn parts[1], turn (D, lines) of size 1: from products instead of D sums of lines."""
    fixed, turned = parts
    mixed = 2 * (turn @ (fixed.conj() * turned)).real
    return np.asarray(np.sqrt(np.maximum(np.vdot(fixed, fixed).real + np.vdot(turned, turned).real + mixed, 0.0)))


def _orthonormal(columns: Complexes) -> Complexes:
    """Columns (lines, 3) made orthonormal under the real scalar product Re(a* b)."""
    stacked = np.vstack([columns.real, columns.imag])
    q, _ = np.linalg.qr(stacked / np.maximum(np.linalg.norm(stacked, axis=0), np.finfo(float).tiny))
    half = len(columns)
    return np.asarray(q[:half] + 1j * q[half:])
