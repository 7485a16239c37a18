"""Static analysis with the hub centres held: transmission error, stiffness and load sharing over the mesh cycle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.coupling import coupling
from gearbench.fem.contact.law import PAIRS, Law, Meetings, find_pairs, off_flanks, overlaps
from gearbench.fem.contact.sharing import Flags, newton_step, share_load
from gearbench.kernels.compiled import compiled

Array = NDArray[np.float64]

MARGIN = 20e-6  # pairs with a smaller gap may be closed by the deflection of their neighbours [m]


class ContactError(ValueError):
    """A load that the modelled flanks cannot carry, or that does not converge."""


@dataclass(frozen=True)
class StaticCycle:
    """Static response over mesh phase; arrays (load, phase) unless noted.

    load_kind "torque" [N m] or "dte" [m]; phase (phase,) [cycles]; transmission_error [m]; torque_driver,
    torque_driven [N m]; force [N] = torque_driver / driver base radius; stiffness_tangent [N/m] = dF/d dte;
    stiffness_secant [N/m] = F / (dte - unloaded); load_share (load, phase, pair): share of each driver tooth, in order
    of meshing; unloaded (phase,): transmission error without load [m], which errors and micro-geometry make.
    """

    load_kind: Literal["torque", "dte"]
    load: Array
    phase: Array
    transmission_error: Array
    torque_driver: Array
    torque_driven: Array
    stiffness_tangent: Array
    stiffness_secant: Array
    load_share: Array
    unloaded: Array


class Equilibrium(NamedTuple):
    """Equilibrium of the n pairs near contact."""

    pairs: Meetings  # (n,)
    force: Array  # (n,) [N]
    active: Flags  # (n,) whether they carry
    torque_driver: float  # [N m]
    torque_driven: float
    tangent: float  # d(driver torque)/d theta1 [N m/rad]
    flexibility: Array  # (n, n) [m/N] tangent to this state
    converged: bool


@compiled
def position(
    law: Law, theta1: float, theta2: float, x1: float, y1: float, x2: float, y2: float, guess: Array
) -> Equilibrium:
    """Equilibrium of all pairs at given hub positions; guess (PAIRS,) [N] of their forces."""
    pairs = find_pairs(law, theta1, theta2, law.centre + x2 - x1, y2 - y1, MARGIN)
    n = len(pairs)
    load = share_load(law.curves, pairs, overlaps(pairs), coupling(law, pairs), 1.0, guess[:n])
    t1 = 0.0
    t2 = 0.0
    lever = np.zeros(n)
    for p in range(n):
        sign = 1.0 - 2.0 * pairs[p].side
        lever[p] = sign * pairs[p].lever1
        t1 += lever[p] * load.force[p]
        t2 += sign * pairs[p].lever2 * load.force[p]
    stiff = newton_step(lever, load.flexibility, load.active)
    tangent = 0.0
    for p in range(n):
        tangent += lever[p] * stiff[p]
    return Equilibrium(pairs, load.force, load.active, t1, t2, tangent, load.flexibility, load.converged)


def static_cycle(
    law: Law,
    phases: Array,
    *,
    torque: Sequence[float] | None = None,
    dte: Sequence[float] | None = None,
    progress: Callable[[float], None] | None = None,
    key: str = "torque_nm",
) -> StaticCycle:
    """Static response at the mesh phases [cycles], at given driver torques [N m] or given DTE values [m].

    The driven gear stands at its nominal angle; the driver is turned until the torque, or the DTE, is reached.
    Raises ContactError where contact leaves the modelled flank or equilibrium is not found; `key` is what it calls a
    torque.
    """
    if (torque is None) == (dte is None):
        raise ContactError("give either torques or transmission errors for the static cycle")
    loads = np.asarray(torque if torque is not None else dte, dtype=float)
    kind: Literal["torque", "dte"] = "torque" if torque is not None else "dte"
    if loads.ndim != 1 or not np.all(np.isfinite(loads)) or np.any(loads <= 0):
        raise ContactError(f"static loads must be positive and finite, not {loads.tolist()}")
    shape = (len(loads), len(phases))
    te, t1, t2, tangent = (np.empty(shape) for _ in range(4))
    share = np.zeros((*shape, PAIRS))
    guess = 0.0
    unloaded = np.array([unloaded_dte(law, float(phase)) for phase in phases])
    for i, load in enumerate(loads):
        named = f"{key} = {load:g}" if kind == "torque" else f"dte_um = {1e6 * load:g}"
        for j, phase in enumerate(phases):
            if kind == "torque":
                guess = solve_torque(law, float(phase), float(load), guess)
            else:
                guess = float(load)
            found = _at(law, float(phase), guess)
            if not found.converged:
                raise ContactError(f"no static equilibrium at mesh phase {phase:g} with {named}")
            _check_flanks(law, float(phase), guess, named)
            te[i, j], t1[i, j], t2[i, j] = guess, found.torque_driver, found.torque_driven
            tangent[i, j] = found.tangent / law.driver.rb**2
            total = max(float(found.force.sum()), 1e-300)
            first = int(np.floor(phase)) - 2
            sides, teeth = found.pairs["side"].tolist(), found.pairs["tooth"].tolist()
            for side, tooth, force in zip(sides, teeth, found.force, strict=True):
                if side == 0 and 0 <= tooth - first < PAIRS:
                    share[i, j, tooth - first] = force / total
            if progress:
                progress((i * len(phases) + j + 1) / te.size)
    used = np.nonzero(share.any(axis=(0, 1)))[0]
    share = share[:, :, used[0] : used[-1] + 1] if len(used) else share[:, :, :1]
    pressed = te - unloaded
    # Where a given DTE does not close the gap nothing is pressed, and there is no stiffness.
    secant = np.divide(t1 / law.driver.rb, pressed, out=np.zeros(shape), where=pressed > 0)
    return StaticCycle(kind, loads, np.asarray(phases), te, t1, t2, tangent, secant, share, unloaded)


STILL = np.zeros(2)


def unloaded_dte(law: Law, phase: float, x: Array = STILL, y: Array = STILL) -> float:
    """DTE [m] at which the first working flank touches without load: the manufactured transmission error, 0 for ideal
    gears whose centres are held."""
    if law.play == 0.0 and not (x.any() or y.any()):
        return 0.0
    opened = law.play + float(np.abs(x).sum() + np.abs(y).sum())
    dte = 0.0
    for _ in range(40):
        theta1 = phase * law.driver.pitch + dte / law.driver.rb
        place = law.centre + x[1] - x[0], y[1] - y[0]
        pairs = find_pairs(law, theta1, phase * law.driven.pitch, *place, 2.5 * opened + MARGIN)
        gaps = pairs["gap"][pairs["side"] == 0]
        if not len(gaps):
            break
        least = float(gaps.min())
        dte += least
        if abs(least) <= 1e-15 * (1.0 + abs(phase) * law.driver.pitch * law.driver.rb):
            return dte
    raise ContactError(f"no tooth pair touches without load at mesh phase {phase:g}")


def _check_flanks(law: Law, phase: float, dte: float, load: str) -> None:
    """Raise ContactError where a pair overlaps beyond its modelled flanks; `load`: its key and value."""
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    if off_flanks(law, theta1, phase * law.driven.pitch, law.centre, 0.0):
        errors = f", or the errors that move the flanks by up to {1e6 * law.play:.4g} um" if law.play > 0.0 else ""
        raise ContactError(
            f"{load} takes contact off the modelled flanks at mesh phase {phase:g}, where the transmission error is"
            f" {1e6 * dte:.4g} um: lower it{errors}"
        )


def _at(law: Law, phase: float, dte: float, x: Array = STILL, y: Array = STILL) -> Equilibrium:
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    return position(law, theta1, phase * law.driven.pitch, x[0], y[0], x[1], y[1], np.zeros(PAIRS))


def solve_torque(
    law: Law, phase: float, torque: float, guess: float = 0.0, x: Array = STILL, y: Array = STILL
) -> float:
    """Driver rotation times its base radius [m] at which it carries `torque` [N m]: safeguarded Newton iteration.

    With the centres held (x = y = 0, the displacements of driver and driven centre [m]) this is the DTE.
    """
    rb = law.driver.rb
    # Moving the centres by y opens the pair by up to |y|, so the search starts from there.
    opened = float(np.abs(y).sum() + np.abs(x).sum()) + law.play
    dte = guess if guess > 0 else opened + torque / rb / 1e8
    low, high = -opened, np.inf
    if law.play > 0.0:
        # Errors make the DTE of either sign: the search starts where the first pair touches.
        low = unloaded_dte(law, phase, x, y) - 1e-12
        dte = guess if guess > low else low + torque / rb / 1e8
    # Gaps are differences of angles that grow with the phase: below this the DTE is rounding.
    finest = 1e-15 * (1.0 + abs(phase) * law.driver.pitch) * rb
    for _ in range(200):
        found = _at(law, phase, dte, x, y)
        t1, slope = found.torque_driver, found.tangent / rb
        if not found.converged:
            raise ContactError(f"no static equilibrium at mesh phase {phase:g} and DTE {dte:g} m")
        if abs(t1 - torque) <= 1e-12 * torque:
            return dte
        low, high = (dte, high) if t1 < torque else (low, dte)
        step = dte + (torque - t1) / slope if slope > 0 else dte + opened + abs(dte)
        if not low < step < high:
            step = 0.5 * (low + high) if np.isfinite(high) else dte + opened + abs(dte)
        if abs(step - dte) <= finest or (np.isfinite(high) and high - low <= finest):
            return step
        dte = step
    raise ContactError(f"the DTE at mesh phase {phase:g} and {torque:g} N m did not converge")
