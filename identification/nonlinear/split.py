"""Signal, noise, even and odd distortion and the operating response of records under a coset multisine.

Excited are the lines +-1 modulo d, the lines to the mesh frequency (grid "coset"). A linear periodically time-varying
system answers on the lines of the same classes, whatever it is. An answer of degree p to the excitation, its
coefficients periodic with the mesh, lies on sums of p excited lines:

    class 0                     operating response, and part of the even distortion
    +-1                         linear response, and part of the odd distortion
    other even, odd classes     even, odd distortion (degrees 2, 4, .. and 3, 5, ..)

Period scatter is noise. Empty classes for distortion: Pintelon and Schoukens, System Identification, 2012, section 4.3.

* Even distortion on the operating lines: what changes there with the phases of the excitation is seen as scatter over
  the realisations; all of it from records of another size of excitation, Y_0 = O + a^2 E with a the force's rms.
* Odd distortion on the excited lines: for v = z + conj z, z on class 1, the cube has z^3 on class 3 and 3 z^2 conj z on
  class 1. |3 z^2 conj z| = 3 |z^3| at every instant, so that it holds three times what classes +-3 hold. Two thirds of
  its power are coherent with the excitation and change the measured response, one third looks like noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.identification.excitation.multisine import COSET_LEAST
from gearbench.identification.spectra.course import speed_varies
from gearbench.identification.spectra.joint import Complexes, Floats, Spectra, SpectraError
from gearbench.identification.spectra.records import record_spectra

SCHEMA = "gearbench-distortion/1"
PARTS = ("operating", "signal", "even", "odd")
# A line is excited if its force exceeds this part of the strongest one's: noise and distortion of the force stay below.
EXCITED = 0.03
# Standard deviations of the noise's power beyond which a part stands out of it.
SURE = 3.1
# In bending a cube, the excited lines take this much more than classes +-3.
CUBE = 3.0
# Sizes of excitation that tell even distortion from the operating response differ by at least this factor.
APART = 1.2


class DistortionError(SpectraError):
    """Records whose lines do not tell distortion from the response; the sentence says what is missing."""


def is_coset(records: Sequence[xr.Dataset]) -> bool:
    """Whether the records were excited on the lines +-1 modulo the mesh lines only, as `distortion` needs: never where
    the speed varies.

    Raises SpectraError for records without force or of no common sampling.
    """
    if speed_varies(records):
        return False
    spectra, _, _ = record_spectra(records, sidebands=0)
    return not _unfit(spectra)


def distortion(
    records: Sequence[xr.Dataset],
    other: Sequence[xr.Dataset] | None = None,
    *,
    band: tuple[float, float] | None = None,
) -> xr.Dataset:
    """Split the DTE of records under a coset multisine (schema gearbench-distortion/1).

    `records`: realisations of one condition; `other`: the same with an excitation of another size, which tells even
    distortion on the operating lines from the operating response; `band` [Hz]: lines that count (default: up to the
    highest excited one). Returned: `rms` and `limit` (part,) [m], parts operating, signal, even, odd: rms of a
    realisation with the noise's power taken off, and the rms beyond which a part stands out of the noise; `line_rms`,
    `line_noise` (frequency,) [m] of single lines, `line_part` their index in `part`. Attributes: `noise_rms` [m] of
    the mean over periods, `share` = sqrt(even^2 + odd^2) / signal, `operating_scatter_rms`: what changes on the
    operating lines from one realisation to the next, `odd_inside_rms`: odd distortion on the excited lines as of a
    memoryless cube, `operating_even_rms` (with `other`), `force_share`: rms of the force off the excited lines over
    that on them, `warnings`. What one period or one realisation cannot tell is absent, and `limit` is NaN. Raises
    DistortionError (a SpectraError) for another grid, and what `identify` raises for unfit records.

    >>> import gearbench as gb
    >>> coset = ["realisations=4", "multisine.grid=coset", "samples_per_period=16384"]
    >>> record = gb.simulate(gb.read_case("quick_lumped", [f"experiment.{key}" for key in coset]))
    >>> bool(gb.identification.distortion([record]).attrs["share"] < 1e-3)  # a linear model
    True
    """
    spectra, excited, _ = record_spectra(records, top=band[1] if band else None, sidebands=0)
    unfit = _unfit(spectra)
    if unfit:
        raise DistortionError(unfit)
    low, high = band or (0.0, excited[1])
    lines = np.arange(1, spectra.highest + 1)
    lines = lines[(lines * spectra.spacing >= low - 1e-9) & (lines * spectra.spacing <= high + 1e-9)]
    response = _at_phase_zero(spectra)[:, lines]
    part = line_parts(lines, spectra.mesh_lines)
    if not all((part == number).any() for number in range(len(PARTS))):
        raise DistortionError(f"band {low:g}-{high:g} Hz holds no line of one of the classes; widen it")
    noise = None if spectra.noise is None else spectra.noise[lines]
    power, limit = _powers(response, part, noise, spectra.periods)
    attributes: dict[str, Any] = {
        "mesh_lines": spectra.mesh_lines,
        "realisations": spectra.realisations,
        "periods_averaged": spectra.periods,
        "share": sqrt((power[2] + power[3]) / power[1]) if power[1] > 0 else np.inf,
        "odd_inside_rms": CUBE * sqrt(_third(response, lines, spectra.mesh_lines, noise)),
        "force_share": _force_share(spectra, lines, part),
    }
    if noise is not None:
        attributes["noise_rms"] = sqrt(2 * float(noise.sum()))
    if spectra.realisations > 1:
        attributes["operating_scatter_rms"] = sqrt(_scatter(response[:, part == 0], noise, part == 0))
    if other is not None:
        attributes |= _told_apart(spectra, other, lines[part == 0])
    attributes["warnings"] = "\n".join(_doubts(attributes, noise))
    rms = np.asarray(np.sqrt(power), dtype=float)
    frequency = np.asarray(lines * spectra.spacing, dtype=float)
    return _dataset(frequency, rms, limit, response, noise, part, attributes)


def line_parts(lines: NDArray[np.int64], mesh_lines: int) -> NDArray[np.int64]:
    """Index in PARTS of each line of a coset with `mesh_lines` to the mesh frequency (same shape).

    >>> line_parts(np.arange(9), 8).tolist()
    [0, 1, 2, 3, 2, 3, 2, 1, 0]
    """
    folded = np.minimum(lines % mesh_lines, -lines % mesh_lines)
    return np.where(folded == 0, 0, np.where(folded == 1, 1, np.where(folded % 2 == 0, 2, 3)))


def _unfit(spectra: Spectra) -> str:
    """Why the lines of these records do not tell distortion; empty if they do."""
    strength = np.abs(spectra.force).max(axis=0)
    excited = 1 + np.flatnonzero(strength[1:] > EXCITED * strength[1:].max())
    d = spectra.mesh_lines
    if spectra.repeats > 1:
        return (
            f"an excitation period holds {d / spectra.repeats:g} mesh periods, and distortion is told from the response"
            f' by grid = "coset" only, which needs an even number of at least {COSET_LEAST}'
        )
    if d < COSET_LEAST or d % 2 or not np.isin(excited % d, (1, d - 1)).all():
        off = excited[~np.isin(excited % d, (1, d - 1))] if d > 1 else excited
        which = f", and line {off[0]} is excited" if off.size else ""
        return (
            f"distortion is told from the response where only lines +-1 modulo the lines to the mesh frequency are"
            f' excited (grid = "coset", at least {COSET_LEAST}, even); here they are {d}{which}'
        )
    return ""


def _at_phase_zero(spectra: Spectra) -> Complexes:
    """Response (E, lines) of all realisations begun at the mesh phase of the first."""
    shift = np.outer(spectra.relative(), np.arange(spectra.highest + 1)) / spectra.mesh_lines
    return np.asarray(spectra.dte * np.exp(-2j * np.pi * shift))


def _powers(
    response: Complexes, part: NDArray[np.int64], noise: Floats | None, periods: int
) -> tuple[Floats, Floats]:
    """Power (part,) [m^2] of a realisation less the noise's, and the rms beyond which it stands out."""
    count = response.shape[0]
    measured = 2 * np.mean(np.abs(response) ** 2, axis=0)
    power = np.array([measured[part == number].sum() for number in range(len(PARTS))])
    if noise is None:
        return power, np.full(len(PARTS), np.nan)
    own = np.array([2 * noise[part == number].sum() for number in range(len(PARTS))])
    # Of complex Gaussian lines the power has a standard deviation of itself; that of the noise estimate adds.
    square = np.array([4 * np.sum(noise[part == number] ** 2) for number in range(len(PARTS))])
    spread = np.sqrt(square * (1 / count + 1 / (count * max(periods - 1, 1))))
    return np.maximum(power - own, 0.0), np.sqrt(SURE * spread)


def _third(response: Complexes, lines: NDArray[np.int64], mesh_lines: int, noise: Floats | None) -> float:
    """Power [m^2] on classes +-3 less the noise's."""
    own = np.isin(lines % mesh_lines, (3, mesh_lines - 3))
    power = 2 * np.mean(np.abs(response[:, own]) ** 2, axis=0).sum()
    return max(float(power - (2 * noise[own].sum() if noise is not None else 0.0)), 0.0)


def _scatter(operating: Complexes, noise: Floats | None, own: NDArray[np.bool_]) -> float:
    """Power [m^2] of what changes on the operating lines with the realisation, less the noise's."""
    power = 2 * np.var(operating, axis=0, ddof=1).sum()
    return max(float(power - (2 * noise[own].sum() if noise is not None else 0.0)), 0.0)


def _force_share(spectra: Spectra, lines: NDArray[np.int64], part: NDArray[np.int64]) -> float:
    """Rms of the force on the lines of even and odd distortion over that on the excited ones."""
    power = np.sum(np.abs(spectra.force[:, lines]) ** 2, axis=0)
    return float(np.sqrt(power[part > 1].sum() / power[part == 1].sum()))


def _told_apart(spectra: Spectra, other: Sequence[xr.Dataset], lines: NDArray[np.int64]) -> dict[str, float]:
    """Rms of operating response and even distortion on the operating lines, from two sizes of excitation."""
    second, _, _ = record_spectra(other, top=spectra.highest * spectra.spacing, sidebands=0)
    if second.mesh_lines != spectra.mesh_lines or abs(second.spacing / spectra.spacing - 1) > 1e-9:
        raise DistortionError(
            f"the other records have {second.mesh_lines} lines to the mesh frequency, {second.spacing:g} Hz apart, but"
            f" these {spectra.mesh_lines} and {spectra.spacing:g} Hz: only the size of the excitation may differ"
        )
    unfit = _unfit(second)
    if unfit:
        raise DistortionError(f"the other records: {unfit}")
    first_size, second_size = (float(np.mean(np.sum(np.abs(s.force[:, 1:]) ** 2, axis=1))) for s in (spectra, second))
    factor = sqrt(max(first_size, second_size) / min(first_size, second_size))
    if factor < APART:
        raise DistortionError(
            f"the excitations differ in size by a factor of {factor:.3g}; even distortion is told from the operating"
            f" response from {APART:g} on"
        )
    start = replace(second, start_phase=np.concatenate([spectra.start_phase[:1], second.start_phase]))
    shift = np.outer(start.relative()[1:], np.arange(second.highest + 1)) / second.mesh_lines
    mean = _at_phase_zero(spectra)[:, lines].mean(axis=0)
    mean_other = (second.dte * np.exp(-2j * np.pi * shift))[:, lines].mean(axis=0)
    even = (mean - mean_other) * first_size / (first_size - second_size)
    return {
        "operating_even_rms": sqrt(2 * float(np.sum(np.abs(even) ** 2))),
        "operating_alone_rms": sqrt(2 * float(np.sum(np.abs(mean - even) ** 2))),
    }


def _doubts(attributes: dict[str, Any], noise: Floats | None) -> list[str]:
    notes = []
    if noise is None:
        notes.append("one period was recorded: noise is not told apart and counts as distortion")
    if attributes["force_share"] > 0.3 * attributes["share"] and attributes["force_share"] > 1e-6:
        notes.append(
            f"the force holds {attributes['force_share']:.2g} of itself on lines that were not excited: its distortion"
            " and noise are among those of the response"
        )
    return notes


def _dataset(
    frequency: Floats,
    rms: Floats,
    limit: Floats,
    response: Complexes,
    noise: Floats | None,
    part: NDArray[np.int64],
    attributes: dict[str, Any],
) -> xr.Dataset:
    lines = np.sqrt(2 * np.mean(np.abs(response) ** 2, axis=0))
    of_noise = np.full(frequency.size, np.nan) if noise is None else np.sqrt(2 * noise)
    metres = {"units": "m"}
    return xr.Dataset(
        {
            "rms": ("part", rms, metres),
            "limit": ("part", limit, metres),
            "line_rms": ("frequency", lines, metres),
            "line_noise": ("frequency", of_noise, metres),
            "line_part": ("frequency", part, {"units": "1", "flag_meanings": " ".join(PARTS)}),
        },
        coords={"part": list(PARTS), "frequency": ("frequency", frequency, {"units": "Hz"})},
        attrs={"schema": SCHEMA, **attributes},
    )
