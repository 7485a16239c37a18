"""Samples that a channel, or a device with several, lost or doubled: its delay leaps within the record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.records.clocks.delays import Delays, delays_of
from gearbench.records.clocks.devices import groups_of
from gearbench.records.clocks.drift import delay_between
from gearbench.records.clocks.late import SUSPICIOUS, lag_of
from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import EXCITED, Look
from gearbench.records.seen.mesh_force import AGREE, accounts_of

Array = NDArray[np.float64]

# Stretches in which delays are told (in long ones longer delays), and fewest samples of one.
STRETCHES, FEWEST = (8, 4), 1024
# Samples by which a delay leaps at least, in deviations of the stretches on either side, of LEAST samples at least; and
# part of the disagreement's power that a leap may leave.
LEAP, SURE, LEAST, LEFT = 0.5, 6.0, 0.05, 0.8
# Lines that a period needs at least, and how much less of what it differs by from the first one a shift must leave.
LINES, EXPLAINED = 120, 0.5


@dataclass(frozen=True)
class Leap:
    """Channels, in words `what`, that come earlier by `samples` after one of `count` stretches; `left`: mean square of
    the misfits without."""

    what: str
    several: bool
    count: int
    stretch: int
    samples: float
    left: float


def channels_keep_step(look: Look) -> list[Finding]:
    """Delays are the same all along the record: where the accounts of the mesh force disagree on the whole, and by no
    common lag, the delay that makes them agree best is told in each stretch. If it is one in all stretches up to some
    and another in all after it, samples are missing or double there. What a rig does looks alike in all stretches.
    """
    whole = accounts_of(look)
    if whole is None or whole.worst < SUSPICIOUS or lag_of(look, whole) is not None:
        return []
    for count in STRETCHES:
        leap = _largest(look, count) if look.samples >= count * FEWEST else None
        if leap is not None:
            return [_finding(look, leap)]
    return []


def _largest(look: Look, count: int) -> Leap | None:
    """The leap that leaves least of the misfits, of any channel or device."""
    pieces = look.stretches(count)
    accounts = [found for piece in pieces if (found := accounts_of(piece)) is not None]
    if len(accounts) < count or len({tuple(one.relations()) for one in accounts}) > 1:
        return None
    delays = [Delays(one, delays_of(piece, one.omega)) for piece, one in zip(pieces, accounts, strict=True)]
    every = sorted(set().union(*(accounts[0].channels(relation) for relation in accounts[0].relations())))
    groups = [(name, frozenset([name])) for name in every]
    groups += [(f"the {words} ({', '.join(sorted(names))})", names) for words, names in groups_of(accounts[0])]
    leaps = [_leap(delays, look.rate, what, names) for what, names in groups]
    return min((leap for leap in leaps if leap is not None), key=lambda leap: leap.left, default=None)


def _leap(delays: list[Delays], rate: float, what: str, names: frozenset[str]) -> Leap | None:
    """The leap of some channels, whose delays are tried in each stretch of a record of `rate` [Hz]; None where there
    is none that is sure."""
    delay, least = np.array([_best(one, names) for one in delays]).T
    now, delay, count = np.array([one.accounts.worst for one in delays]), delay * rate, len(delays)
    rest = [np.delete(np.arange(count), stretch) for stretch in range(1, count - 1)]
    power = [float(np.mean(least[kept] ** 2)) for kept in rest]
    stretch = 1 + int(np.argmin(power))
    kept, left = rest[stretch - 1], power[stretch - 1]
    before, after = (delay[kept[kept < stretch]], delay[kept[kept > stretch]])
    size = float(np.median(after) - np.median(before))
    scatter = np.concatenate([before - np.median(before), after - np.median(after)])
    sure = abs(size) > max(LEAP, SURE * max(float(np.sqrt(np.mean(scatter**2))), LEAST))
    if not sure or left > LEFT * float(np.mean(now[kept] ** 2)) or left > AGREE**2:
        return None
    return Leap(what, len(names) > 1, count, stretch, size, left)


def _best(delays: Delays, names: frozenset[str]) -> tuple[float, float]:
    """The delay [s] of some channels with which all accounts agree best in a stretch, and the worst misfit with it."""
    accounts = delays.accounts
    both = [(relation, accounts.channels(relation)) for relation in accounts.relations()]
    apart = [relation for relation, channels in both if names & channels and not channels <= names]
    if not apart:
        return 0.0, accounts.worst
    fixed = [float(accounts.misfit(relation)[0]) for relation, _ in both if relation not in apart]
    delay, left = delays.best(apart, names)
    return delay, max([left, *fixed])


def periods_keep_step(look: Look) -> list[Finding]:
    """No period of excitation and mesh is the first one shifted in time. For force and dte each by itself, which is all
    that a record without channels of its gears can tell."""
    joint, force, error = look.joint_samples, look.force, look.stored_or_own_dte
    if joint is None or force is None or error is None or not np.ptp(force) > 0:
        return []
    driving = np.abs(np.fft.rfft(force.reshape(-1, joint)[0] - force.mean()))
    lines = np.flatnonzero(driving >= EXCITED * driving.max())
    omega = 2 * np.pi * lines * look.rate / joint
    for name, values in (("dte", error), ("force", force)):
        first, *others = np.fft.rfft(values.reshape(-1, joint) - values.mean(), axis=1)
        for number, other in enumerate(others, start=1):
            found = delay_between(omega, first[lines].conj() * other[lines]) if lines.size >= LINES else None
            if found is None or abs(found[0]) * look.rate < LEAP:
                continue
            back = other[lines] * np.exp(1j * omega * found[0])
            if np.linalg.norm(back - first[lines]) > EXPLAINED * np.linalg.norm(other[lines] - first[lines]):
                continue
            late = found[0] * look.rate
            return [
                Finding(
                    f"the {name} of samples {number * joint} to {(number + 1) * joint} is that of the first"
                    f" {joint} {abs(late):.3g} samples {'later' if late > 0 else 'earlier'} (limit {LEAP:g}):"
                    f" have samples been {'doubled' if late > 0 else 'lost'}, or is mesh_period another one?"
                )
            ]
    return []


def _finding(look: Look, leap: Leap) -> Finding:
    size = look.samples // leap.count
    return Finding(
        f"{leap.what} {'leap' if leap.several else 'leaps'} by {abs(leap.samples):.3g} samples against the other"
        f" channels, between samples {leap.stretch * size - size // 2} and {(leap.stretch + 1) * size + size // 2},"
        f" as the balance of forces at the gears shows in {leap.count} stretches (limit {LEAP:g}):"
        f" {'have they' if leap.several else 'has it'} {'lost' if leap.samples < 0 else 'doubled'} samples?"
    )
