"""The gap budget: where measured minus simulated lies, in shares of the whole.

The whole is the mean square of the fluctuating gap, added up over channels and conditions. Channels of different
units add up because each is in units of its own measured fluctuation (rms about the mean, all conditions pooled): a
gap of 0.1 is a tenth of what that sensor shows, whatever it measures. That is how a noise engineer reads a
deviation, and it keeps a quiet condition from weighing as much as a loud one. DTE stands for both angles, whose
common part would hide the mesh. Mean values are not in the budget (zeros of sensors are rarely known); the gap table
has them.

The whole is divided in several ways (kinds); the shares of each kind add up to 1 (Parseval):

    channel    dte, y_driver, y_driven, torque_driven
    band       the bands of the gap table, and what lies above the excitation
    class      residue class of the line, modulo the lines of a hunting period
    phase      instants with one, two, ... pairs in contact, and around entry and exit of a pair. The response rings
               on: the zone tells when the gap is seen, which is when it arises only far below the resonances
    tooth      half the energy of an instant goes to the driver's tooth next to the pitch point, half to the driven's
    condition  the measured records

Beside each share stand two floors, parts of the same whole: what measurement noise explains (scatter of the
repetitions, unknown with one of them) and what the uncertain parameters of the nominal rig explain, each moved by one
standard deviation (first order, independent).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import (
    bands,
    excited,
    frequencies,
    line_energy,
    measured_channels,
    noise_of_mean,
)
from gearbench.diagnosis.verdict import Kind, Share
from gearbench.geometry import Pair, pair
from gearbench.identification.excitation.comb import residue_class, residue_of
from gearbench.rig import Case

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BUDGET_CHANNELS = ("dte", "y_driver", "y_driven", "torque_driven")
# Reach of the zones around entry and exit of a pair [mesh periods]: away from the path of contact (under load teeth
# touch early and part late) and into it.
OUTWARD, INWARD = 0.1, 0.05
PAIRS_IN_WORDS = {1: "single", 2: "double", 3: "triple"}


@dataclass(frozen=True)
class _Cut:
    """One way to divide a record: the name of each line's or sample's part, by index into `names`."""

    kind: Kind
    names: tuple[str, ...]
    labels: Integers  # (lines,) or (N,)
    of_lines: bool
    weight: float = 1.0


def budget(
    measurements: Sequence[Measurement],
    simulated: Sequence[Mapping[str, Array]],
    nominal: Case,
    variants: Sequence[Sequence[Mapping[str, Array]]] = (),
) -> tuple[Share, ...]:
    """Shares of the gap, kind by kind; each kind adds up to 1. Empty if there is no gap at all.

    `simulated`: for each measurement its replayed channels (`signals.simulated_channels`); `variants`: for each
    uncertain parameter the same with it moved by one standard deviation (empty: that floor is not known). Phase and
    tooth are left out where the origin of a mesh phase is arbitrary. Raises DiagnosisError for inputs that do not
    belong together.
    """
    for one in (simulated, *variants):
        if len(one) != len(measurements):
            raise DiagnosisError(f"{len(measurements)} measurements have {len(one)} simulations; each needs one")
    repetitions = [measured_channels(one) for one in measurements]
    units = _units(repetitions, simulated)
    noisy = all(one.repetitions > 1 for one in measurements)
    sums = {part: _Sums() for part in ("gap", "noise", "nominal")}
    meshing = pair(nominal.rig)
    for number, measurement in enumerate(measurements):
        cuts = _cuts(measurement, measurements, meshing)
        for channel, unit in units.items():
            if channel not in repetitions[number] or channel not in simulated[number]:
                continue
            measured, replay = repetitions[number][channel], simulated[number][channel]
            parts: dict[str, Array] = {"gap": (measured.mean(axis=0) - replay)[None]}
            if noisy:
                parts["noise"] = noise_of_mean(measured)
            if variants:
                parts["nominal"] = np.array([variant[number][channel] - replay for variant in variants])
            for part, values in parts.items():
                sums[part].add(channel, measurement.name, cuts, values / unit)
    return tuple(_shares(sums, noisy, bool(variants)))


class _Sums:
    """Energies by kind and name."""

    def __init__(self) -> None:
        self.energy: dict[tuple[Kind, str], float] = {}
        self.whole = 0.0

    def add(self, channel: str, condition: str, cuts: Sequence[_Cut], values: Array) -> None:
        """Add the fluctuation of the signals `values` (n, N)."""
        values = values - values.mean(axis=-1, keepdims=True)
        lines = line_energy(values).sum(axis=0)
        samples = (values**2).sum(axis=0) / values.shape[-1]
        total = float(samples.sum())
        self.whole += total
        self._put("channel", channel, total)
        self._put("condition", condition, total)
        for cut in cuts:
            weights = lines if cut.of_lines else samples
            parts = np.bincount(cut.labels, weights=weights, minlength=len(cut.names)) * cut.weight
            for name, energy in zip(cut.names, parts, strict=True):
                self._put(cut.kind, name, float(energy))

    def _put(self, kind: Kind, name: str, energy: float) -> None:
        self.energy[kind, name] = self.energy.get((kind, name), 0.0) + energy


def _shares(sums: Mapping[str, _Sums], noisy: bool, varied: bool) -> Iterator[Share]:
    whole = sums["gap"].whole
    if whole <= 0.0:
        return
    order: tuple[Kind, ...] = ("channel", "band", "class", "phase", "tooth", "condition")
    for kind in order:
        for (found, name), energy in sums["gap"].energy.items():
            if found != kind:
                continue
            noise = sums["noise"].energy.get((kind, name), 0.0) / whole if noisy else None
            nominal = sums["nominal"].energy.get((kind, name), 0.0) / whole if varied else None
            both = noise + nominal if noise is not None and nominal is not None else None
            yield Share(
                kind=kind,
                name=name,
                share=min(energy / whole, 1.0),
                floor=both,
                floor_noise=noise,
                floor_nominal=nominal,
            )


def _units(repetitions: Sequence[Mapping[str, Array]], simulated: Sequence[Mapping[str, Array]]) -> dict[str, float]:
    """Rms [channel's unit] of each channel's measured fluctuation, all records pooled; constant channels left out."""
    units = {}
    for channel in BUDGET_CHANNELS:
        squares = [
            float(np.var(measured[channel].mean(axis=0)))
            for measured, replay in zip(repetitions, simulated, strict=True)
            if channel in measured and channel in replay
        ]
        if squares and np.mean(squares) > 0.0:
            units[channel] = float(np.sqrt(np.mean(squares)))
    if not units:
        raise DiagnosisError(f"no channel of {', '.join(BUDGET_CHANNELS)} is both measured and simulated, and moves")
    return units


def _cuts(measurement: Measurement, measurements: Sequence[Measurement], meshing: Pair) -> list[_Cut]:
    cuts = [_band_cut(measurement, measurements), _class_cut(measurement)]
    if all(one.phase_known for one in measurements):
        names, labels = contact_zones(meshing, measurement.phase)
        cuts.append(_Cut("phase", names, labels, False))
        nearest = np.floor(measurement.phase + 0.5).astype(np.int64)
        for gear, profile in (("driver", meshing.driver), ("driven", meshing.driven)):
            teeth = tuple(f"{gear} {tooth}" for tooth in range(profile.teeth))
            cuts.append(_Cut("tooth", teeth, nearest % profile.teeth, False, 0.5))
    return cuts


def _band_cut(measurement: Measurement, measurements: Sequence[Measurement]) -> _Cut:
    # The widest excitation sets the edges for all: bands must be the same ones to be added.
    edges = max((bands(one) for one in measurements), key=lambda found: found[-1][1])
    ends = np.array([high for _, high in edges])
    names = (*(f"{low:g}-{high:g} Hz" for low, high in edges), f"above {ends[-1]:g} Hz")
    labels = np.searchsorted(ends, frequencies(measurement) * (1 - 1e-12), side="left")
    return _Cut("band", names, labels.astype(np.int64), True)


def contact_zones(meshing: Pair, phase: Array) -> tuple[tuple[str, ...], Integers]:
    """Zone names and, for each mesh phase [cycles], the index of its zone.

    Zones: around the instants at which a pair's involutes enter and leave the path of contact ("entry", "exit"), and
    elsewhere by the pairs in contact. Where both reach, the nearer instant counts.
    """
    start, end = meshing.path
    touching = np.floor(phase - start) - np.ceil(phase - end) + 1
    after_start = (phase - start + 0.5) % 1.0 - 0.5
    after_end = (phase - end + 0.5) % 1.0 - 0.5
    entry = (after_start >= -OUTWARD) & (after_start <= INWARD)
    leave = (after_end >= -INWARD) & (after_end <= OUTWARD)
    nearer = np.abs(after_start) <= np.abs(after_end)
    fewest = int(meshing.contact_ratio)
    names = (*(PAIRS_IN_WORDS.get(count, f"{count} pairs") for count in (fewest, fewest + 1)), "entry", "exit")
    labels = np.where(touching > fewest, 1, 0)
    labels[entry & (nearer | ~leave)] = 2
    labels[leave & ~(entry & nearer)] = 3
    return names, labels


def _class_cut(measurement: Measurement) -> _Cut:
    names, labels = line_classes(measurement)
    return _Cut("class", names, labels, True)


def line_classes(measurement: Measurement) -> tuple[tuple[str, ...], Integers]:
    """Class names and, for each line of a repetition, the index of its class (see identification.comb.residue_class).

    The comb is read off the measured torque. Without one, excited lines that carry no shaft order are "excited".
    """
    lines = np.arange(measurement.phase.size // 2 + 1)
    teeth = tuple(int(measurement.record.attrs[f"teeth_{gear}"]) for gear in ("driver", "driven"))
    driven = excited(measurement)
    comb = residue_of(driven, measurement.mesh_cycles)
    found = residue_class(lines, measurement.mesh_cycles, comb, *teeth)
    if comb is None:
        found[driven[found[driven] == "other"]] = "excited"
    names, labels = np.unique(found, return_inverse=True)
    return tuple(str(name) for name in names), labels.astype(np.int64)
