"""Channels of one device are late together: torques, angles, displacements, or all that stands on one side."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gearbench.records.checks.look import GEARS, Look
from gearbench.records.checks.mesh_force import Accounts

Array = NDArray[np.float64]

# Misfit of the accounts below which no delay is looked for, what a delay may leave, and of what was before.
SUSPICIOUS, EXACT, EXPLAINED = 0.03, 0.06, 1 / 3
# Relative error of the response that counts at most on one line.
MOST = 2.0


def groups_of(accounts: Accounts) -> Iterator[tuple[str, frozenset[str]]]:
    """Names and channels (two at least, not all) that a device may hold; of such as say the same the first."""
    every = frozenset().union(*(accounts.channels(relation) for relation in accounts.relations()))
    seen: list[frozenset[str]] = []
    kinds = (("torques", "torque_"), ("angles", "angle_"), ("displacements", "y_"))
    sides = tuple((f"{gear}'s channels", f"_{gear}") for gear in GEARS)
    for words, part in (*kinds, *sides):
        found = frozenset(name for name in every if part in name)
        if len(found) >= 2 and found != every and found not in seen and every - found not in seen:
            seen.append(found)
            yield words, found


def late_device(accounts: Accounts, delays: Array) -> tuple[float, str, frozenset[str], float] | None:
    """What a device that is late leaves of the misfit, its name, its channels and the delay [s]; None if there is none.

    `delays` [s]: evenly spaced ones to try.
    """
    best: tuple[float, str, frozenset[str], float] | None = None
    step = float(delays[1] - delays[0])
    for words, names in groups_of(accounts):
        relations = [one for one in accounts.relations() if names & accounts.channels(one)]
        relations = [one for one in relations if not accounts.channels(one) <= names]
        if not relations:
            continue
        now = max(float(accounts.misfit(relation)[0]) for relation in relations)
        if now < SUSPICIOUS:
            continue
        coarse = float(delays[int(np.argmin(_worst(accounts, relations, names, delays)))])
        fine = coarse + step * np.linspace(-1.0, 1.0, 41)
        found = _worst(accounts, relations, names, fine)
        after, delay = float(found.min()), float(fine[int(np.argmin(found))])
        if after < EXACT and after < EXPLAINED * now and (best is None or after < best[0]):
            best = (after, words, names, delay)
    return best


def _worst(accounts: Accounts, relations: list[tuple[str, str]], names: frozenset[str], at: Array) -> Array:
    turn = np.exp(1j * np.outer(at, accounts.omega))
    return np.asarray(np.max([accounts.misfit(relation, names, turn) for relation in relations], axis=0))


def error_of_lag(look: Look, names: frozenset[str], delay: float) -> float:
    """Relative rms error of the response over the excited lines that channels late by `delay` [s] make; on one line
    MOST of the response at most."""
    force, error = look.force, look.dte
    if force is None or error is None:
        return 0.0
    lines = look.excited(force)
    if look.mesh_period is not None:  # there the operating response hides what the excitation makes
        cycles = look.omega / (2 * np.pi) * look.mesh_period
        between = lines & (np.abs(cycles - np.round(cycles)) > 1e-6)
        lines = between if between.any() else lines
    if not lines.any():
        return 0.0
    turn = (np.exp(1j * look.omega * delay) - 1)[lines]
    driving, response = look.spectrum(force)[lines], look.spectrum(error)[lines]
    of_force, of_dte = (np.zeros(turn.size, dtype=complex) for _ in range(2))
    for name in names:
        part = _part(look, name)
        if part is not None:
            target = of_force if name.startswith("torque_") else of_dte
            target += turn * part[lines]
    tiny = np.finfo(float).tiny
    whole = np.where(np.abs(driving + of_force) > tiny, driving + of_force, tiny)
    right = (response + of_dte) * driving / whole
    wrong = np.minimum(np.abs(right - response), MOST * np.abs(response))
    # Relative to the lesser of the right response and the one that is found: neither is known to be the truth.
    size = min(float(np.linalg.norm(response)), float(np.linalg.norm(right)))
    return float(np.linalg.norm(wrong)) / max(size, tiny)


def _part(look: Look, name: str) -> NDArray[np.complex128] | None:
    """What a channel contributes to force or dte (lines,), with its sign; None where it does not."""
    quantity, gear = name.split("_")
    radius = look.number(f"base_radius_{gear}")
    values = look.swing(gear) if quantity == "angle" else look.channel(name)
    if values is None or radius is None:
        return None
    sign = 1.0 if gear == "driver" else -1.0
    if quantity == "angle":
        return sign * look.spectrum(values) * radius
    if quantity == "y":
        return sign * look.spectrum(values) * (look.support_factor or 1.0)
    if look.record.attrs.get("driven_boundary") == "speed":
        return look.spectrum(values) / radius if gear == "driver" else None
    radii = [look.number(f"base_radius_{one}") for one in GEARS]
    inertias = [look.number(f"inertia_{one}") for one in GEARS]
    if None in radii or None in inertias:
        return None
    r1, r2, j1, j2 = (float(one or 0.0) for one in (*radii, *inertias))
    mass = j1 * j2 / (j1 * r2**2 + j2 * r1**2)
    return look.spectrum(values) * mass * (r1 / j1 if gear == "driver" else r2 / j2)
