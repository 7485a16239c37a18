"""Channels of one device are late together: torques, angles, displacements, or all that stands on one side."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gearbench.records.clocks.delays import Delays, least
from gearbench.records.seen.look import EXCITED, GEARS, Complexes, Look
from gearbench.records.seen.mesh_force import Accounts

Array = NDArray[np.float64]
Lines = NDArray[np.int64]

# Misfit of the accounts below which no delay is looked for, what a delay may leave, and of what was before.
SUSPICIOUS, EXACT, EXPLAINED = 0.03, 0.06, 1 / 3
# Relative error of the response that counts at most on one line.
MOST = 2.0
# Branches by which what the mesh turns aside is judged, and excited lines that tell how much of it there is.
SIDE, GROUP = (-6, -4, -2, -1, 1, 2, 4, 6), 8


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


def late_device(delays: Delays) -> tuple[float, str, frozenset[str], float] | None:
    """What a device that is late leaves of the misfit, its name, its channels and the delay [s]; None if there is
    none."""
    accounts = delays.accounts
    best: tuple[float, str, frozenset[str], float] | None = None
    for words, names in groups_of(accounts):
        relations = [one for one in accounts.relations() if names & accounts.channels(one)]
        relations = [one for one in relations if not accounts.channels(one) <= names]
        if not relations:
            continue
        now = max(float(accounts.misfit(relation)[0]) for relation in relations)
        if now < SUSPICIOUS:
            continue
        delay, after = delays.best(relations, names)
        if after < EXACT and after < EXPLAINED * now and (best is None or after < best[0]):
            best = (after, words, names, delay)
    return best


def far_side(look: Look, accounts: Accounts) -> tuple[float, str, frozenset[str], float] | None:
    """As `late_device`, for all of the driver's channels, late by any part of an excitation period: devices that were
    not started together. The force on one gear against that on the other, correlated at all delays."""
    if set(accounts.gears) != set(GEARS) or float(accounts.misfit(GEARS)[0]) < SUSPICIOUS:
        return None
    own = {name for name in look.record.data_vars if str(name).endswith("_driver")}
    names = frozenset(str(name) for name in own if str(name).split("_")[0] in ("torque", "angle", "y"))
    first, second = (_force(look, gear) for gear in GEARS)
    product = np.fft.irfft(first * second.conj(), look.samples)
    period = int(look.number("samples_per_period") or look.samples)
    if look.samples % period == 0:
        product = product.reshape(-1, period).sum(axis=0)
    late = int(np.argmax(product))
    late -= product.size * (late > product.size // 2)
    delay, after = least(accounts, [GEARS], names, (late + np.linspace(-1.0, 1.0, 81)) / look.rate)
    if after >= EXACT or after >= EXPLAINED * float(accounts.misfit(GEARS)[0]):
        return None
    return after, "driver's channels", names, delay


def _force(look: Look, gear: str) -> Complexes:
    """Spectrum of the force [N] on the mesh as a gear's torque and acceleration have it, up to the highest line looked
    at."""
    torque, swing = look.channel(f"torque_{gear}"), look.swing(gear)
    radius, inertia = look.number(f"base_radius_{gear}") or 1.0, look.number(f"inertia_{gear}")
    assert torque is not None  # there is an account of this gear
    total = look.transform(torque)
    if swing is not None and inertia is not None:
        total -= (1.0 if gear == "driver" else -1.0) * inertia * look.transform(swing, derivative=2)
    total[int(look.lines[-1]) + 1 :] = 0.0
    total[: look.lowest] = 0.0
    return np.asarray(total / radius)


def error_of_lag(look: Look, names: frozenset[str], delay: float) -> float:
    """Relative rms error of the response over the excited lines that channels late by `delay` [s] make; on one line
    MOST of the response at most.

    What the mesh turns aside is counted by itself: force and dte may both change by the same factor on every line, so
    that their ratio is right and sidebands, which come from another line, are not.
    """
    force, error = look.force, look.dte
    if force is None or error is None:
        return 0.0
    lines = look.lines[look.excited(force)]
    d = 0
    if look.mesh_period is not None and not look.tapered:
        cycles = lines * look.rate / look.samples * look.mesh_period
        between = np.abs(cycles - np.round(cycles)) > 1e-6  # elsewhere the operating response hides the excitation's
        lines = lines[between] if between.any() else lines
        d = round(look.samples / look.rate / look.mesh_period)
    if not lines.size:
        return 0.0
    driving = _changes(look, names, delay, force, "torque_")
    response = _changes(look, names, delay, error, "")
    direct = _wrong(response, driving, lines, lines)
    sides = [(n, lines[(lines > n * d) & (lines - n * d <= look.lines[-1])]) for n in SIDE] if d else []
    asides = [_wrong(response, driving, some, some - n * d) for n, some in sides if some.size]
    share = _turned_aside(driving[0], response[0], int(look.lines[-1]), d)
    aside = float(np.sqrt(share * np.mean(np.square(asides)))) if asides else 0.0
    return max(direct, aside)


def _changes(look: Look, names: frozenset[str], delay: float, now: Array, kind: str) -> tuple[Complexes, Complexes]:
    """Spectra of force (`kind` "torque_") or dte as it is, and as it is without the lag."""
    omega = 2 * np.pi * np.arange(look.samples // 2 + 1) * look.rate / look.samples
    found = look.transform(now)
    right = found.copy()
    for name in names:
        part = _part(look, name) if name.startswith("torque_") == bool(kind) else None
        if part is not None:
            right += (np.exp(1j * omega * delay) - 1) * look.transform(part)
    return found, right


def _wrong(
    response: tuple[Complexes, Complexes], driving: tuple[Complexes, Complexes], to: Lines, come_from: Lines
) -> float:
    """Relative rms error of the branches that lead from lines of the force to lines of the dte."""
    found, right = (one[to] for one in response)
    tiny = np.finfo(float).tiny
    before, after = (one[come_from] for one in driving)
    wanted = right * before / np.where(np.abs(after) > tiny, after, tiny)
    wrong = np.minimum(np.abs(wanted - found), MOST * np.abs(found))
    # Relative to the lesser of the right response and the one that is found: neither is known to be the truth.
    size = min(float(np.linalg.norm(found)), float(np.linalg.norm(wanted)))
    return float(np.linalg.norm(wrong)) / max(size, tiny)


def _turned_aside(driving: Complexes, response: Complexes, top: int, d: int) -> float:
    """Part of the dte's power that does not go with the force of its own line, over groups of GROUP excited lines; 0
    without mesh lines. Noise is in it."""
    size = np.abs(driving[: top + 1])
    lines = np.flatnonzero(size >= EXCITED * size[1:].max(initial=0.0))
    lines = lines[(lines > 0) & (lines % d > 0)] if d else lines[:0]
    groups = lines[: lines.size // GROUP * GROUP].reshape(-1, GROUP)
    if not groups.size:
        return 0.0
    u, y = driving[groups], response[groups]
    own = np.abs((u.conj() * y).sum(axis=1)) ** 2 / (np.abs(u) ** 2).sum(axis=1)
    return float(1 - own.sum() / (np.abs(y) ** 2).sum())


def _part(look: Look, name: str) -> Array | None:
    """What a channel contributes to force or dte (samples,), with its sign; None where it does not."""
    quantity, gear = name.split("_")
    radius = look.number(f"base_radius_{gear}")
    values = look.swing(gear) if quantity == "angle" else look.channel(name)
    if values is None or radius is None:
        return None
    sign = 1.0 if gear == "driver" else -1.0
    if quantity == "angle":
        return sign * values * radius
    if quantity == "y":
        return sign * values * (look.support_factor or 1.0)
    if look.record.attrs.get("driven_boundary") == "speed":
        return values / radius if gear == "driver" else None
    radii = [look.number(f"base_radius_{one}") for one in GEARS]
    inertias = [look.number(f"inertia_{one}") for one in GEARS]
    if None in radii or None in inertias:
        return None
    r1, r2, j1, j2 = (float(one or 0.0) for one in (*radii, *inertias))
    mass = j1 * j2 / (j1 * r2**2 + j2 * r1**2)
    return values * mass * (r1 / j1 if gear == "driver" else r2 / j2)
