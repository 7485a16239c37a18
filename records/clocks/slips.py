"""Angles that part from each other: a pulse that an encoder missed, or clocks that run at different rates.

Gears in mesh pass the same teeth. Their angles on the line of action differ by the DTE, which swings but goes nowhere
as long as speed and load are steady, and which nothing moves within one sample by many times what the others do.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import GEARS, Look

# A step between two samples of so many times the 99th percentile of all of them (1.6 times is the most in 283 records
# of sound rigs), which stays: of the samples around it at least this part of it is left.
STEP, STAYS, AROUND = 4.0, 0.5, 32
# Steps of an angle over the 99th percentile of all: samples are missing in all channels (gears that twist by as much as
# they turn reach 2).
MISSING = 3.5
# Way that the dte goes along the record, in its rms fluctuation, and the part at both ends that tells it. What repeats
# goes by no more than three times its rms (1.7 in those 283 records).
GONE, END = 5.0, 8
FEWEST = 256


def angles_do_not_slip(look: Look) -> list[Finding]:
    """No angle leaps from one sample to the next and stays there.

    Told by the difference of both angles, in which what the gears do together is gone; the one that leaps more has
    leapt.
    """
    arcs = [_arc(look, gear) for gear in GEARS]
    if arcs[0] is None or arcs[1] is None or not look.steady or look.samples < FEWEST:
        return []
    place, size, limit = largest_step(arcs[0] - arcs[1])
    if place is None:
        return []
    moves = [np.diff(arc) for arc in arcs if arc is not None]
    leaps = [float(abs(move[place] - np.median(move[max(place - AROUND, 0) : place + AROUND]))) for move in moves]
    number = int(np.argmax(leaps))
    radius = look.number(f"base_radius_{GEARS[number]}") or 1.0
    return [
        Finding(
            f"angle_{GEARS[number]} leaps by {abs(size) / radius:.3g} rad, {1e6 * abs(size):.3g} um on the base circle,"
            f" between samples {place} and {place + 1} and stays there (limit {1e6 * limit:.2g} um, {STEP:g} times what"
            " 99 % of the samples move by): did the encoder miss or double a pulse?"
        )
    ]


def no_gap_in_all_channels(look: Look) -> list[Finding]:
    """Neither gear turns by many times its step from one sample to the next."""
    angles = [values for gear in GEARS if (values := look.channel(f"angle_{gear}")) is not None]
    if not angles or look.samples < FEWEST:
        return []
    moves = [np.diff(values) for values in angles]
    usual = [float(np.percentile(np.abs(move), 99)) for move in moves]
    place = int(np.argmax(moves[0]))
    leaps = [float(move[place]) / size if size > 0 else 0.0 for move, size in zip(moves, usual, strict=True)]
    if min(leaps) < MISSING:
        return []
    lost = float(moves[0][place] / np.median(moves[0])) - 1
    return [
        Finding(
            f"the gears turn {leaps[0]:.3g} times as far as in 99 % of the steps between samples {place} and"
            f" {place + 1} (limit {MISSING:g}): about {lost:.0f} samples are missing in the angles, or in all channels"
        )
    ]


def _arc(look: Look, gear: str) -> NDArray[np.float64] | None:
    """Way (samples,) [m] of a gear on its base circle beside steady rotation."""
    swing, radius = look.swing(gear), look.number(f"base_radius_{gear}")
    return None if swing is None or radius is None else radius * swing


def largest_step(values: NDArray[np.float64]) -> tuple[int | None, float, float]:
    """The sample (0..n-2) after which `values` (n,) leap and stay, or None, as of a leap at their very ends; its size,
    and the limit."""
    moves = np.diff(values)
    moves = moves - np.median(moves)
    limit = STEP * float(np.percentile(np.abs(moves), 99))
    place = int(np.abs(moves).argmax())
    size = float(moves[place])
    before, after = values[max(place + 1 - AROUND, 0) : place + 1], values[place + 1 : place + 1 + AROUND]
    left = float(np.median(after) - np.median(before)) / size if size else 0.0
    told = min(before.size, after.size) > AROUND // 4 and left > STAYS
    return (place if abs(size) > limit > 0 and told else None), size, limit


def gears_pass_the_same_teeth(look: Look) -> list[Finding]:
    """The dte of both angles goes nowhere along the record."""
    speeds = [look.number(f"base_radius_{gear}") for gear in GEARS]
    if not look.steady or look.samples < FEWEST or any(look.channel(f"angle_{gear}") is None for gear in GEARS):
        return []
    if look.dte is None or speeds[0] is None or look.mesh_period is None:
        return []
    way, swing = gone(look.dte, look.mesh_period * look.rate)
    if not abs(way) > GONE * swing > 0:
        return []
    travelled = speeds[0] * look.speed("driver") * look.samples / look.rate
    teeth = f"{look.number('teeth_driver'):g}/{look.number('teeth_driven'):g}" if look.number("teeth_driven") else "?"
    pitch = 2 * pi * speeds[0] / (look.number("teeth_driver") or 1.0)
    return [
        Finding(
            f"angle_driver and angle_driven part by {1e6 * abs(way):.3g} um on the line of action along the record"
            f" ({abs(way) / pitch:.2g} base pitches, {1e6 * abs(way / travelled):.3g} ppm of its length; the dte"
            f" fluctuates by {1e6 * swing:.2g} um rms, limit {GONE:g} times that), while gears of {teeth} teeth stay"
            " together: clocks of different rate, or a wrong number of teeth"
        )
    ]


def gone(values: NDArray[np.float64], period: float) -> tuple[float, float]:
    """How far `values` (n,) go from their beginning to their end, by the means of whole `period`s [samples] there, and
    the rms of what is left beside a straight line of that slope."""
    count = max(values.size // END, 1)
    count = min(max(round(max(count // period, 1) * period), 1), values.size // 2)
    slope = float(values[-count:].mean() - values[:count].mean()) / (values.size - count)
    left = values - slope * np.arange(values.size)
    return slope * values.size, float(left.std())
