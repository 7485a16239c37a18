"""From records to spectra: period averaging, mesh phase, verification of the steady state."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearbench.identification.spectra.excited import excited_lines
from gearbench.identification.spectra.joint import (
    STEADY,
    Floats,
    Spectra,
    SpectraError,
    is_steady,
    joint_periods,
    period_spectra,
)
from gearbench.identification.spectra.transmission_error import AngleOnlyWarning, dte, force
from gearbench.records.antialias import Lag, common_lag

# Largest departure of the mesh phase from a straight line [cycles] that is passed over.
PHASE_WANDER = 2e-3
# Largest drift of the mesh phase against the mesh period over a record [cycles].
DRIFT = 0.3
SAME = 1e-9
# Part of a line that a filter must leave for the line to be of use.
PASSED = 0.5


@dataclass(frozen=True)
class Sampling:
    """How all records of one condition are sampled: rate [Hz], samples a joint period, joint periods, d, repeats."""

    rate: float
    joint: int
    mesh_lines: int
    repeats: int


def record_spectra(
    records: Sequence[xr.Dataset], *, top: float | None = None, sidebands: int
) -> tuple[Spectra, tuple[float, float], list[str]]:
    """Spectra of all realisations of the records, the excited band [Hz], and warnings.

    Lines are kept up to `top` [Hz] (default: the end of the excited band) plus `sidebands` mesh harmonics
    and a quarter more. Raises SpectraError or TransmissionError with the sentence to print.
    """
    if not records:
        raise SpectraError("no record to identify")
    notes: list[str] = []
    sampling = _common_sampling(records)
    nyquist = (sampling.joint - 1) // 2
    band = _excited_band(records, sampling)
    last = (top if top is not None else band[1]) * sampling.joint / sampling.rate
    highest = min(nyquist, int(1.25 * last) + sidebands * sampling.mesh_lines)
    spacing = sampling.rate / sampling.joint
    lags = [common_lag(record) for record in records]
    highest = min([highest, *(_passed(lag, spacing, highest) for lag in lags if lag is not None)])
    lines = np.arange(max(1, int(band[0] / spacing)), min(highest, int(band[1] / spacing)) + 1)
    forces, responses, phases, noises, steady = [], [], [], [], []
    angles = False
    for record, lag in zip(records, lags, strict=True):
        unfiltered = 1.0 if lag is None else 1.0 / lag.response(spacing * np.arange(highest + 1))
        phases.append(_start_phases(record, 1.0 / (sampling.mesh_lines * spacing), notes))
        settled = _declared_steady(record)
        for driving, error, alone in _signals(record, notes):
            angles |= alone
            forces.append(period_spectra(driving, sampling.joint, highest)[0] * unfiltered)
            response, blocks, noise = period_spectra(error, sampling.joint, highest)
            responses.append(response * unfiltered)
            steady.append(settled or is_steady(blocks, lines))
            if noise is not None:
                noises.append(noise * np.abs(unfiltered) ** 2)
    spectra = Spectra(
        np.array(forces),
        np.array(responses),
        spacing,
        sampling.mesh_lines,
        np.concatenate(phases),
        all(steady),
        records[0].sizes["time"] // sampling.joint,
        sampling.repeats,
        np.mean(noises, axis=0) if noises else _declared_noise(records[0], sampling, highest),
        angles,
        sampling.joint,
    )
    return spectra, band, list(dict.fromkeys(notes))


def _passed(lag: Lag, spacing: float, highest: int) -> int:
    """The highest line of which a filter has left PASSED at least."""
    left = np.abs(lag.response(spacing * np.arange(highest + 1))) >= PASSED
    return int(np.flatnonzero(left)[-1])


def _signals(record: xr.Dataset, notes: list[str]) -> Iterator[tuple[Floats, Floats, bool]]:
    """Force and DTE of each realisation, and whether that is of angles only; one at a time: long records stay lean."""
    for realisation in range(record.sizes["realisation"]):
        one = record.isel(realisation=[realisation])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AngleOnlyWarning)
            error = dte(one)
        alone = bool(error.attrs.get("angle_only"))
        if alone:
            notes.append("dte holds the angles only (no y channels): what is identified from it is biased")
        yield force(one).values[0], error.values[0], alone


def _excited_band(records: Sequence[xr.Dataset], sampling: Sampling) -> tuple[float, float]:
    """Lowest and highest frequency [Hz] that the forces excite above their noise."""
    power = np.zeros((sampling.joint - 1) // 2 + 1)
    noise, count = np.zeros_like(power), 0
    for record in records:
        for realisation in range(record.sizes["realisation"]):
            signal = force(record.isel(realisation=[realisation])).values[0]
            mean, _, scatter = period_spectra(signal, sampling.joint, power.size - 1)
            power += np.abs(mean) ** 2
            if scatter is not None:
                noise, count = noise + scatter, count + 1
    if not power[1:].max() > 1e-24 * max(power[0], np.finfo(float).tiny):
        raise SpectraError("the force is constant: without excitation nothing can be identified")
    excited = np.flatnonzero(excited_lines(power, noise if count else None))
    spacing = sampling.rate / sampling.joint
    return float(excited[0] * spacing), float(excited[-1] * spacing)


def _common_sampling(records: Sequence[xr.Dataset]) -> Sampling:
    first = records[0]
    for name in ("sampling_rate", "samples_per_period", "periods"):
        for record in records:
            if name not in record.attrs:
                raise SpectraError(f"the record lacks attribute {name}")
            if abs(float(record.attrs[name]) - float(first.attrs[name])) > SAME * float(first.attrs[name]):
                raise SpectraError(
                    f"the records differ in {name} ({first.attrs[name]} and {record.attrs[name]}); realisations of"
                    " one condition must not"
                )
    rate, samples = float(first.attrs["sampling_rate"]), int(first.attrs["samples_per_period"])
    periods = int(first.attrs["periods"])
    mesh = [mesh_period(record) for record in records]
    means = [float(record.attrs["torque_mean"]) for record in records if "torque_mean" in record.attrs]
    if means and max(means) - min(means) > SAME * max(abs(mean) for mean in means):
        raise SpectraError(
            f"the records differ in torque_mean: {min(means):g} to {max(means):g} N m; they must be of one condition"
        )
    if max(mesh) - min(mesh) > 1e-6 * mesh[0]:
        raise SpectraError(f"the records differ in mesh_period: {min(mesh):g} to {max(mesh):g} s")
    if first.sizes["time"] != samples * periods:
        raise SpectraError(
            f"the record has {first.sizes['time']} samples, not samples_per_period x periods = {samples * periods}"
        )
    repeats, mesh_lines = joint_periods(samples, rate, periods, mesh[0])
    return Sampling(rate, samples * repeats, mesh_lines, repeats)


def mesh_period(record: xr.Dataset) -> float:
    """Mesh period [s] from the attribute, else from the slope of the mesh_phase channel."""
    if "mesh_period" in record.attrs:
        period = float(record.attrs["mesh_period"])
    elif "mesh_phase" in record:
        phase = record["mesh_phase"].values[0]
        time = np.arange(phase.size) / float(record.attrs["sampling_rate"])
        line = np.polynomial.Polynomial.fit(time, phase, 1)
        wander = float(np.abs(phase - line(time)).max())
        if wander > DRIFT:
            raise SpectraError(
                f"the mesh phase departs by {wander:.3g} cycles from that of a constant speed (limit {DRIFT:g}): a"
                " response is identified at a constant one"
            )
        period = 1.0 / float(np.polyfit(time, phase, 1)[0])
    else:
        raise SpectraError("the record has neither attribute mesh_period nor channel mesh_phase")
    if not np.isfinite(period) or period <= 0:
        raise SpectraError(f"mesh_period = {period:g} s must be positive")
    return period


def _start_phases(record: xr.Dataset, period: float, notes: list[str]) -> Floats:
    """Mesh phase [cycles] of each realisation's first sample."""
    count = record.sizes["realisation"]
    if str(record.attrs.get("mesh_phase_origin", "geometry")) == "arbitrary":
        notes.append("the origin of the mesh phase is arbitrary (mesh_phase_origin)")
    if "mesh_phase" in record:
        steps = np.arange(record.sizes["time"]) / (float(record.attrs["sampling_rate"]) * period)
        start = np.empty(count)
        for row in range(count):
            departure = record["mesh_phase"].values[row] - steps
            start[row] = departure.mean()
            _require_speed(departure, steps)
            wander = np.abs(departure - start[row]).max()
            if wander > PHASE_WANDER:
                notes.append(
                    f"the mesh phase departs from constant speed by {wander:.2g} cycles; branches l lose"
                    f" coherence from about l = {max(1, round(0.1 / wander))}"
                )
        return start
    if "mesh_phase" in record.attrs:
        return np.full(count, 1.0) * np.asarray(record.attrs["mesh_phase"], dtype=float)
    notes.append("the record does not know the mesh phase: phase 0 is the start of the record")
    return np.zeros(count)


def _require_speed(departure: Floats, steps: Floats) -> None:
    """Raise SpectraError where the mesh phase drifts away from the mesh period by more than DRIFT."""
    cycles = float(steps[-1] - steps[0])
    drift = cycles * float(np.polyfit(steps, departure, 1)[0]) if cycles else 0.0
    if abs(drift) > DRIFT:
        raise SpectraError(
            f"mesh_phase runs through {cycles + drift:.6g} cycles where mesh_period says {cycles:.6g} (limit {DRIFT:g}"
            " apart): wrong number of teeth, mesh period or sampling rate"
        )


def _scatter(record: xr.Dataset) -> float | None:
    """Rms departure of single periods' dte from the stored mean [m], where the record is a mean of periods."""
    if int(record.attrs.get("periods_averaged", 1)) < 2:
        return None
    weights = (
        {"dte": 1.0}
        if "dte" in record
        else {
            "angle_driver": float(record.attrs.get("base_radius_driver", 0.0)),
            "angle_driven": float(record.attrs.get("base_radius_driven", 0.0)),
            "y_driver": 1.0,
            "y_driven": 1.0,
        }
    )
    names = [name for name in weights if name in record]
    if any("period_scatter" not in record[name].attrs for name in names):
        return None
    return float(np.sqrt(sum((weights[n] * float(record[n].attrs["period_scatter"])) ** 2 for n in names)))


def _declared_steady(record: xr.Dataset) -> bool:
    """Whether the record itself vouches for a steady state: the simulation's residual, or averaged periods' scatter."""
    if float(record.attrs.get("settling_residual", np.inf)) <= STEADY:
        return True
    scatter = _scatter(record)
    if scatter is None:
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AngleOnlyWarning)
        size = float(dte(record.isel(realisation=[0])).std())
    return scatter <= STEADY * size


def _declared_noise(record: xr.Dataset, sampling: Sampling, highest: int) -> Floats | None:
    """Variance of a line of the mean over periods from the record's own scatter, taken as white; None if unknown."""
    scatter = _scatter(record)
    if scatter is None:
        return None
    of_mean = scatter**2 / (int(record.attrs["periods_averaged"]) - 1)
    return np.full(highest + 1, of_mean / sampling.joint)
