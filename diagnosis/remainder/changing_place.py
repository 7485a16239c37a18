"""Where the force acts that changes from one repetition to the next, by what it moves in the rig found.

A force at one place moves all channels at once, in proportions that are the rig's own: of a line's departures between
repetitions in all channels one complex size is left open, and what is left beside it says how well the place explains
them. It is as right as that rig, and needs no equation of motion with numbers and filters of its own. Lines at which
the torque that is measured on the driver changes tell nothing of a force that is missing, nor does what one sensor
alone would show.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.evidence.calibration import Limits
from gearbench.diagnosis.forces.equations import PLACES
from gearbench.diagnosis.forces.steadiness import Unsteady, driven_otherwise, scatter_of
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.remainder.free_forces import motion_of
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import FITTED, TINY
from gearbench.lumped.nonlinear.coordinates import IN_MESH, LOAD, U2, Acting
from gearbench.rig.contract import Place

if TYPE_CHECKING:
    from gearbench.bench.nonlinear.along import Along

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Integers = NDArray[np.int64]

# Part of what changes, by energy, that a force at a place must explain for it to act there, and of what the next best
# place leaves, the part that the best one may leave.
EXPLAINS, TOLD = 0.5, 0.5
# Mesh phases at which the rig is struck: the mean over them has no part of what meshing moves to other lines.
STRUCK = 8


def placed(
    unsteady: Unsteady, limits: Limits, found: Simulated, steady: Collection[Measurement], *, much: bool
) -> Unsteady:
    """What changes between repetitions with the place at which the rig found is moved like that, where the force
    residuals see it beyond their limits, or more changes than on sound rigs (`much`)."""
    # Flanks that part in all records meet again a little otherwise, which acts in the mesh of a sound rig too.
    if unsteady.worst(limits.unsteady)[1] <= 1.0 and not (much and found.simulator.anchored):
        return unsteady
    try:
        return unsteady._replace(acts=place_of_changes(found, steady))
    except ValueError:  # a rig without steady motion tells no place
        return unsteady


def place_of_changes(found: Simulated, steady: Collection[Measurement]) -> Place | None:
    """The place at which a force explains most of what changes between repetitions of the `steady` records, among those
    of the search; None where none explains half, another or one sensor does nearly as well, or channels are too few to
    tell. Raises ValueError where the rig has no steady motion in one of them."""
    simulator, p = found.simulator.free, found.end_of(found.selection.best)
    names = {one.name for one in steady}
    energy, left, sensors = 0.0, np.zeros(len(PLACES)), dict[str, float]()
    for measured in simulator.target.measurements:
        if measured.name not in names or measured.repetitions < 2:
            continue
        departures, at, units = _changing(simulator, measured)
        if at.size and len(units) > 1:
            answers = unit_answers(simulator, p, measured, int(at[-1]))
            moved = np.stack([answers[name][:, at] / unit for name, unit in units.items()], axis=1)
            energy += float((np.abs(departures) ** 2).sum())
            left += left_beside(departures, moved)
            shown = _of_sensors(simulator, units, at.size)
            for name, beside in zip(shown, left_beside(departures, np.array(list(shown.values()))), strict=True):
                sensors[name] = sensors.get(name, 0.0) + float(beside)
    order = np.argsort(left)
    best, following = left[order[0]], min([left[order[1]], *sensors.values()])
    if best > (1.0 - EXPLAINS) * energy or best >= TOLD * following:
        return None
    return PLACES[int(order[0])]


def _of_sensors(simulator: Simulator, units: Mapping[str, float], lines: int) -> dict[str, Complex]:
    """What each sensor alone would show (channels, K): a displacement's is in the transmission error, too, which stands
    for the angles."""
    model, names = simulator.layout.model, list(units)
    out = {}
    for number, name in enumerate(names):
        shown = np.zeros((len(names), lines), dtype=complex)
        shown[number] = 1.0 / units[name]
        if name.startswith("y_") and "dte" in units and {"y_driver", "y_driven"} <= set(names):
            sense = 1.0 if name == "y_driver" else -1.0
            shown[names.index("dte")] = sense * model.support_factor / units["dte"]
        out[name] = shown
    return out


def left_beside(departures: Complex, moved: Complex) -> Array:
    """Energy (places,) that is left of departures (P, channels, K) beside those of a force at each place, of any size
    in each line and repetition; `moved` (places, channels, K): what a unit force moves."""
    whole = float((np.abs(departures) ** 2).sum())
    squares = np.maximum((np.abs(moved) ** 2).sum(axis=1), TINY)
    along = np.einsum("ick,pck->ipk", moved.conj(), departures)
    return np.asarray(whole - (np.abs(along) ** 2 / squares[:, None]).sum(axis=(1, 2)))


def unit_answers(simulator: Simulator, p: Array, measured: Measurement, last: int) -> Mapping[str, Complex]:
    """What the channels of a record change by (places, lines up to the `last`) under a unit force at each place of the
    rig of unknowns (size,), in its own line [per N]: the mean over strokes at all mesh phases."""
    motion = motion_of(simulator, p, measured)
    entries = len(motion.phase)
    # Each a mesh cycle and a part of the next one after the one before.
    cycle = (entries - 1) / abs(float(motion.phase[-1] - motion.phase[0]))
    at = np.arange(STRUCK) * (1.0 + 1.0 / STRUCK) * cycle / entries
    earlier = np.exp(-2j * np.pi * np.outer(at, np.arange(last + 1)))
    strokes = np.fft.irfft(earlier, entries, axis=1).T
    values, on, of = [], [], []
    for number, coordinates in enumerate(_coordinates(motion)):
        for coordinate, factor in coordinates:
            values.append(factor * strokes)
            on.append(np.full(STRUCK, coordinate))
            of.append(number * STRUCK + np.arange(STRUCK))
    acting = Acting(np.concatenate(values, axis=1, dtype=np.float32), np.concatenate(on), np.concatenate(of))
    out = {}
    for channel, lines in simulator.answers(measured, motion, acting).items():
        struck = lines[:, : last + 1].reshape(len(PLACES), STRUCK, -1)
        out[channel] = (struck / earlier).mean(axis=1) * (entries / measured.phase.size)
    return out


def _coordinates(motion: Along) -> list[tuple[tuple[int, float], ...]]:
    """The coordinates that a force at each place acts on, each with its part."""
    model = motion.model
    one, two = (tuple((number, part) for number, part in enumerate(spring.along) if part)
                for spring in model.support_springs)  # fmt: skip
    load = LOAD if model.rig.load.twists else U2
    by_place: dict[Place, tuple[tuple[int, float], ...]] = {
        "drive": ((motion.drive, 1.0),),
        "driver-support": one,
        "load": ((load, 1.0),),
        "driven-support": two,
        "mesh": ((IN_MESH, 1.0),),
    }
    return [by_place[place] for place in PLACES]


def _changing(simulator: Simulator, measured: Measurement) -> tuple[Complex, Integers, dict[str, float]]:
    """Repetitions' departures (P, channels, K) from their mean, in units of the noise, at the lines at which any
    channel changes, these lines (K,), and the unit by channel."""
    last = max(int(bins[-1]) for number, _, bins in simulator.target.plan
               if simulator.target.measurements[number] is measured)  # fmt: skip
    channels = measured_channels(measured)
    lines = {name: np.fft.rfft(channels[name])[:, : last + 1] / channels[name].shape[-1]
             for name in FITTED if name in channels}  # fmt: skip
    changing, units, departures = np.zeros(last + 1, dtype=bool), {}, []
    for name, several in lines.items():
        scatter = scatter_of(several[:, 1:])
        # A channel that is the same in all repetitions is none that was measured.
        if scatter.white > 0.0:
            changing[1:] |= scatter.changing
            units[name] = float(np.sqrt(scatter.white))
            departures.append((several - several.mean(axis=0)) / units[name])
    changing &= ~driven_otherwise(measured, last)
    at = np.flatnonzero(changing)
    return np.array([one[:, at] for one in departures]).swapaxes(0, 1), at, units
