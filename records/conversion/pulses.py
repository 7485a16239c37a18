"""Pulses of an encoder track, counted: none may be missing or double, but for the gap of an index."""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Array

# Steps on either side of one whose median foretells it, where pulses are uneven: more of them for slower changes.
FEW, MANY = 3, 9
# A step that is foretold lacks no pulse up to LACKS[0] times that; nor does it up to LACKS[1], where the track's own
# steps are foretold as badly. Of two successive steps, a half of their sum, with a pulse too many: one part in TWICE.
LACKS, TWICE = (1.5, 1.8), (1.5, 1.6)
# How badly: this quantile of all departures, and the factor up to which it is usual.
QUANTILE, USUAL = 0.999, 1.5
# Widest gap [steps] of an index.
WIDEST = 12
_PAD = 2 * MANY


@dataclass(frozen=True, eq=False)
class Foretold:
    """How far steps depart from what those beside them foretell, as logarithms (n,): from both sides together
    (`between`), and from the `nearer` of the left and the right one."""

    between: Array
    nearer: Array


@dataclass(frozen=True, eq=False)
class Faults:
    """Departures `excess` (n,) as logarithms, 0 where there is no fault; the largest one from the nearer side (`sure`);
    the `limit` that stands for the track, as a factor."""

    excess: Array
    sure: float
    limit: float

    @property
    def found(self) -> int:
        """How many there are."""
        return int(np.count_nonzero(self.excess))

    @property
    def worst(self) -> int:
        """Where the largest is."""
        return int(self.excess.argmax())


def pulse_numbers(times: Array, pulses: float, name: str, notes: list[str]) -> Array:
    """Number of each pulse (n,), from 0, at rising `times` [s] of an encoder with places for so many `pulses` a turn.

    A gap that comes once a turn is an index, its missing pulses are counted, and `notes` say so. Raises RecordError
    for times that do not rise, for a pulse that is missing, and for one too many.
    """
    steps = np.diff(times)
    if steps.min() <= 0:
        bad = int(np.argmax(steps <= 0)) + 1
        raise RecordError(
            f"{name}: pulse {bad} at {times[bad]:.9g} s does not come after the one before, at {times[bad - 1]:.9g} s"
            " (times of pulses must rise): if the counter starts again, add its range from there on"
        )
    logs = np.log(steps)
    lacking, double = _missing(logs), _double(logs)
    if not lacking.found and not double.found:
        return np.arange(times.size, dtype=np.float64)
    moves = _index(logs, pulses)
    if moves is not None:
        notes.append(f"{name} has a gap of {moves.max():.0f} steps once a turn: taken for its index")
        return np.concatenate([[0.0], np.cumsum(moves)])
    # Beside a fault of one kind, steps may look like the other one: less sure on one side.
    if lacking.sure >= double.sure:
        bad = lacking.worst
        raise RecordError(
            f"{name}: {np.exp(lacking.excess[bad]):.3g} usual steps pass after pulse {bad} (limit {lacking.limit:.3g},"
            f" by the steps beside it): pulses are missing ({lacking.found} such gap(s)), and it is no index, which is"
            f" a gap once in {pulses:g} places"
        )
    bad = double.worst
    raise RecordError(
        f"{name}: pulses {bad}, {bad + 1} and {bad + 2} lie within {2 * np.exp(-double.excess[bad]):.3g} usual steps"
        f" (limit {2 / double.limit:.3g}, by the steps beside them): one of them is too many, as of a contact that"
        " bounces"
    )


def _missing(logs: Array) -> Faults:
    """Steps (n,), of these logarithms, that lack a pulse."""
    return _faults(_foretold(logs, logs, 1, 1.0), LACKS)


def _double(logs: Array) -> Faults:
    """Pairs (n - 1,) of steps, of these logarithms, with a pulse too many."""
    pairs = np.logaddexp(logs[1:], logs[:-1]) - log(2)
    return _faults(_foretold(pairs, logs, 2, -1.0), TWICE)


def _foretold(target: Array, logs: Array, width: int, sign: float) -> tuple[Foretold, ...]:
    """`sign` times the departures of a `target` (n,), which takes `width` steps from each place on, from what the steps
    on either side foretell: by a cubic, which follows fast changes, and by medians, which do not mind uneven pulses."""
    padded = np.pad(logs, _PAD, mode="reflect")

    def at(series: Array, offset: int) -> Array:
        return series[_PAD + offset : _PAD + offset + target.size]

    first, second = (width + 1) / 2, (width + 3) / 2
    left, right = (at(padded, -1), at(padded, -2)), (at(padded, width), at(padded, width + 1))
    weight = second**2 / (second**2 - first**2)
    between = 0.5 * (weight * (left[0] + right[0]) + (1 - weight) * (left[1] + right[1]))
    sides = [near + first * (near - far) for near, far in (left, right)]
    found = [Foretold(sign * (target - between), np.minimum(*(sign * (target - side) for side in sides)))]
    for size in (FEW, MANY):
        middle = median_filter(padded, size=size, mode="nearest")
        ends = (at(middle, -(size + 1) // 2), at(middle, width - 1 + (size + 1) // 2))
        departures = [sign * (target - end) for end in ends]
        found.append(Foretold(0.5 * (departures[0] + departures[1]), np.minimum(*departures)))
    return tuple(found)


def _usual(foretold: tuple[Foretold, ...]) -> list[float]:
    """How far from each foretelling the steps of the track are, for all that is known, without a fault."""
    return [USUAL * float(np.quantile(np.abs(one.between), QUANTILE)) for one in foretold]


def _faults(foretold: tuple[Foretold, ...], limits: tuple[float, float]) -> Faults:
    """What departs beyond the limit, by what foretells the track best and by all that foretell it well enough, and on
    both sides: beside a fault only one does."""
    usual = _usual(foretold)
    lowest, highest = log(limits[0]), log(limits[1])
    best = int(np.argmin(usual))
    excess, sure = np.zeros((2, foretold[0].between.size))
    for number, (one, level) in enumerate(zip(foretold, usual, strict=True)):
        if number == best or level <= lowest:
            least = float(np.clip(level, lowest, highest))
            beyond = (one.between > least) & (one.nearer > least / 2)
            excess = np.where(beyond, np.maximum(excess, one.between), excess)
            sure = np.where(beyond, np.maximum(sure, one.nearer), sure)
    return Faults(excess, float(sure.max()), float(np.exp(np.clip(usual[best], lowest, highest))))


def _index(logs: Array, pulses: float) -> Array | None:
    """Places (n,) that each step moves on, where the same one of every turn takes several, and nothing else is amiss;
    None where there is no such index. At least two of its gaps are needed."""
    if pulses != round(pulses):
        return None
    foretold = _foretold(logs, logs, 1, 1.0)
    for width in range(2, WIDEST + 1):
        turn = round(pulses) - width + 1
        if turn < width or logs.size <= turn:
            continue
        for number, one in enumerate(foretold):
            place = _place(one.between, turn)
            excess = one.between[place::turn]
            if excess.min() < log(width) / 2 or round(float(np.exp(np.median(excess)))) != width:
                continue
            moves = np.ones(logs.size)
            moves[place::turn] = width
            even = logs - np.log(moves)
            # The steps must be such that this is what foretells them.
            fits = number == int(np.argmin(_usual(_foretold(even, even, 1, 1.0))))
            if fits and not _missing(even).found and not _double(even).found:
                return moves
    return None


def _place(excess: NDArray[np.float64], turn: int) -> int:
    """The place within a turn of so many steps, among those that come at least twice, whose least excess is largest."""
    rows = -(-excess.size // turn)
    folded = np.full(rows * turn, np.inf)
    folded[: excess.size] = excess
    least = folded.reshape(rows, turn).min(axis=0)
    if rows == 2:
        least[excess.size - turn :] = -np.inf
    return int(least.argmax())
