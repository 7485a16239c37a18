"""Identification of a time-varying frequency response from records: the one public function."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from math import sqrt
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.identification.feedback.estimate import mesh_feedback
from gearbench.identification.feedback.frf import feedback_frf
from gearbench.identification.feedback.varying_frf import LOST, signals_of, speed_varies, varying_frf
from gearbench.identification.lpm.accuracy import MISSING, Accuracy, RecordRule, expected_accuracy, record_rule
from gearbench.identification.lpm.estimate import LpmResult, local_polynomial
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.regression import Window
from gearbench.identification.lpm.selection import LADDER, choose_window
from gearbench.identification.response.frf import make_frf
from gearbench.identification.response.mode_spread import natural_frequency_deviation
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.spectra.joint import Spectra, SpectraError
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.truth.periodic import itf_from_htf
from gearbench.records import RecordError
from gearbench.records.checks import check_record, same_samples
from gearbench.records.record import require_finite

Progress = Callable[[float, str], None]

# About this many output frequencies unless a step is given.
OUTPUT_LINES = 1500
METHODS = ("lpm", "mesh-feedback")
# Expected error of mesh-feedback beyond which the local polynomial method is tried as well.
SECOND_OPINION = 0.05
# Equations of mesh-feedback beyond which further realisations are left out.
ENOUGH = 20_000
# Results beyond this expected error carry a warning.
DOUBTFUL = 0.1


@dataclass(frozen=True)
class IdentificationSettings:
    """How to identify. None: chosen from the record.

    method "lpm", the local polynomial method: `harmonics` L (branches on each side), `order` R, `window` n
    (half-width in lines); or "mesh-feedback": `harmonics` of the mesh stiffness, order and window unused; `band`
    [Hz]: output frequencies (default: the excited band); `step`: lines between them; `phases`: of the ITF;
    `transient`: "estimate" polynomials for it, "none", or "auto": only where the record does not prove its
    steady state; `modes`: at most that many.
    """

    method: Literal["lpm", "mesh-feedback"] = "lpm"
    harmonics: int | None = None
    order: int | None = None
    window: int | None = None
    band: tuple[float, float] | None = None
    step: int | None = None
    phases: int = 256
    transient: Literal["auto", "estimate", "none"] = "auto"
    modes: int | None = None

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise LpmError(f"method = {self.method!r} is unknown; methods are 'lpm' and 'mesh-feedback'")
        for name in ("order", "window"):
            if self.method != "lpm" and getattr(self, name) is not None:
                raise LpmError(f"{name} = {getattr(self, name)} belongs to method 'lpm', not to {self.method!r}")
        if self.transient not in ("auto", "estimate", "none"):
            raise LpmError(f"transient = {self.transient!r} must be 'auto', 'estimate' or 'none'")
        limits = {"harmonics": 0, "order": 0, "window": 1, "step": 1, "phases": 1, "modes": 0}
        for name, least in limits.items():
            value = getattr(self, name)
            if value is not None and value < least:
                raise LpmError(f"{name} = {value} must be at least {least}")
        if self.order and self.window and self.order > 2 * self.window:
            raise LpmError(f"order = {self.order} needs window = {self.window} of at least {-(-self.order // 2)}")
        if self.band is not None and not 0 <= self.band[0] < self.band[1]:
            raise LpmError(f"band = {self.band[0]:g}-{self.band[1]:g} Hz must rise from at least 0")


def identify(
    records: Sequence[xr.Dataset],
    settings: IdentificationSettings | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Frequency response (schema gearbench-frf/1, kind "identified") of records that are realisations of one condition.

    Reports `progress(fraction, message)`. Raises RecordError for a record that contradicts itself, SpectraError,
    TransmissionError or LpmError (all ValueError) with one sentence when the records do not fit together or cannot
    support the request. What is doubtful about a record but may be right is among the warnings and in the expected
    error.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=2"]))
    >>> settings = gb.IdentificationSettings(harmonics=8, order=1, window=12, band=(500.0, 1500.0))
    >>> frf = gb.identify([record], settings)
    >>> dict(frf["itf_re"].sizes), frf["itf_re"].attrs["units"]
    ({'frequency': 501, 'phase': 256}, 'm/N')
    >>> f"{frf.attrs['expected_error']:.0%}"
    '12%'
    """
    settings = settings or IdentificationSettings()
    report = progress or (lambda fraction, message: None)
    report(0.0, "spectra")
    for record in records:
        for name in record.data_vars:
            require_finite(record[name])
    if settings.method == "mesh-feedback" and speed_varies(records):
        return _at_varying_speed(records, settings, report)
    if speed_varies(records, LOST):
        raise SpectraError(
            f"the mesh phase departs from constant speed, which the local polynomial method needs, by more than"
            f" {LOST:g} cycles; method mesh-feedback follows the measured phase"
        )
    sidebands = settings.harmonics if settings.harmonics is not None else LADDER[-1]
    spectra, excited, notes = record_spectra(
        records, top=settings.band[1] if settings.band else None, sidebands=sidebands
    )
    report(0.05, "what the records say about themselves")
    doubts, cost = _doubts(records)
    return identify_spectra(spectra, excited, settings, notes=[*doubts, *notes], record_error=cost, progress=report)


def identify_spectra(
    spectra: Spectra,
    excited: tuple[float, float],
    settings: IdentificationSettings,
    *,
    notes: Sequence[str] = (),
    record_error: float = 0.0,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The response from spectra whose force covers the band `excited` [Hz]; as `identify`, which makes them of records.

    `notes` become warnings; `record_error`: what doubtful channels may cost. Raises LpmError.
    """
    report = progress or (lambda fraction, message: None)
    lines = output_lines(spectra, settings.band or excited, excited, settings.step)
    given = list(notes)
    if settings.method == "mesh-feedback":
        frf = _by_feedback(spectra, settings, lines, excited, given, record_error, report)
        if frf.attrs["expected_error"] > SECOND_OPINION:
            frf = _second_opinion(frf, spectra, replace(settings, harmonics=None), lines, given, record_error, report)
    else:
        frf = _by_polynomials(spectra, settings, lines, given, record_error, report)
    report(1.0, "identified")
    return frf


def _by_polynomials(
    spectra: Spectra,
    settings: IdentificationSettings,
    lines: NDArray[np.int64],
    notes: list[str],
    cost: float,
    report: Progress,
) -> xr.Dataset:
    transient = settings.transient == "estimate" or (settings.transient == "auto" and not spectra.steady)
    report(0.1, "choosing branches, order and window")
    window = choose_window(
        spectra,
        lines,
        transient=transient,
        harmonics=settings.harmonics,
        order=settings.order,
        half_width=settings.window,
    )
    result = local_polynomial(spectra, lines, window, progress=lambda part, message: report(0.2 + 0.7 * part, message))
    report(0.9, "modes")
    return _dataset(spectra, settings, window, result, notes, cost)


def _by_feedback(
    spectra: Spectra,
    settings: IdentificationSettings,
    lines: NDArray[np.int64],
    excited: tuple[float, float],
    notes: list[str],
    cost: float,
    report: Progress,
) -> xr.Dataset:
    highest = round(excited[1] / spectra.spacing)
    kept = min(spectra.realisations, max(1, -(-ENOUGH // highest)))
    if kept < spectra.realisations:
        notes = [*notes, f"mesh-feedback uses the first {kept} of {spectra.realisations} realisations: they are enough"]
    part = replace(
        spectra, force=spectra.force[:kept], dte=spectra.dte[:kept], start_phase=spectra.start_phase[:kept]
    )
    found = mesh_feedback(
        part,
        highest,
        harmonics=settings.harmonics,
        progress=lambda share, message: report(0.1 + 0.6 * share, message),
    )
    report(0.7, "response of the mesh-feedback model")
    return feedback_frf(
        part,
        lines,
        found,
        phases=settings.phases,
        modes=settings.modes,
        notes=notes,
        record=cost,
        attributes={"method": settings.method, "settings": json.dumps(asdict(settings)), **_about(part)},
    )


def _at_varying_speed(records: Sequence[xr.Dataset], settings: IdentificationSettings, report: Progress) -> xr.Dataset:
    """Mesh feedback with the measured phase."""
    doubts, cost = _doubts(records)
    signals, spectra = signals_of(records, ENOUGH)
    excited = (signals.lowest * spectra.spacing, signals.excited * spectra.spacing)
    frf = varying_frf(
        signals,
        spectra,
        output_lines(spectra, settings.band or excited, excited, settings.step),
        harmonics=settings.harmonics,
        phases=settings.phases,
        modes=settings.modes,
        notes=doubts,
        record=cost,
        attributes={"method": settings.method, "settings": json.dumps(asdict(settings)), **_about(spectra)},
        progress=lambda part, message: report(0.1 + 0.6 * part, message),
    )
    report(1.0, "identified")
    return frf


def _second_opinion(
    frf: xr.Dataset,
    spectra: Spectra,
    settings: IdentificationSettings,
    lines: NDArray[np.int64],
    notes: list[str],
    cost: float,
    report: Progress,
) -> xr.Dataset:
    """The local polynomial method's result where it expects to err less, else `frf`; both say so."""
    expected = frf.attrs["expected_error"]
    try:
        other = _by_polynomials(spectra, replace(settings, method="lpm"), lines, notes, cost, report)
    except LpmError:
        return frf
    if other.attrs["expected_error"] >= expected:
        return frf
    said = f"mesh-feedback expects to err by {expected:.1%} here (unexplained {frf.attrs['unexplained_error']:.1%})"
    other.attrs["warnings"] = "\n".join(
        [f"{said}: this is the result of the local polynomial method instead", other.attrs["warnings"]]
    ).strip()
    return other


def _doubts(records: Sequence[xr.Dataset]) -> tuple[list[str], float]:
    """What is doubtful about the records, and the rms error that it may leave: records count alike, doubts about one
    are independent."""
    copies = same_samples(records)
    if copies is not None and copies[0][0] != copies[1][0]:
        first, second = (place[0] + 1 for place in copies)
        raise RecordError(f"records {first} and {second} of {len(records)} hold the same samples: each one counts once")
    sentences, power = [], 0.0
    for number, record in enumerate(records, start=1):
        source = f"record {number} of {len(records)}" if len(records) > 1 else ""
        for finding in check_record(record, source):
            sentences.append(f"{source}: {finding.sentence}" if source else finding.sentence)
            power += finding.error**2 / len(records)
    return sentences, sqrt(power)


def output_lines(
    spectra: Spectra, band: tuple[float, float], excited: tuple[float, float], step: int | None
) -> NDArray[np.int64]:
    """Output lines inside the band: multiples of `step`, by default about OUTPUT_LINES of them.

    A step that divides d, or is a multiple of it, lets branches share rows. Raises LpmError for a band that
    the record does not excite.
    """
    spacing, d = spectra.spacing, spectra.mesh_lines
    slack = 1e-9 + 2.0  # the outermost lines may just miss a round band limit
    if band[0] < excited[0] - slack * spacing or band[1] > excited[1] + slack * spacing:
        raise LpmError(f"band {band[0]:g}-{band[1]:g} Hz leaves the excited band {excited[0]:g}-{excited[1]:g} Hz")
    first = max(1, int(np.ceil(max(band[0], excited[0]) / spacing - 1e-6)))
    last = int(np.floor(min(band[1], excited[1]) / spacing + 1e-6))
    if step is None:
        wanted = max(1, (last - first + 1) // OUTPUT_LINES)
        step = max(s for s in range(1, wanted + 1) if d % s == 0 or s % d == 0)
    lines = np.arange(-(-first // step) * step, last + 1, step)
    if lines.size < 3:
        raise LpmError(
            f"band {band[0]:g}-{band[1]:g} Hz holds {lines.size} line(s) at a step of {step * spacing:g} Hz; at least 3"
            " are needed"
        )
    return lines


def _dataset(
    spectra: Spectra,
    settings: IdentificationSettings,
    window: Window,
    result: LpmResult,
    notes: list[str],
    cost: float,
) -> xr.Dataset:
    frequency = np.asarray(result.lines * spectra.spacing, dtype=float)
    response = itf_from_htf(result.htf, settings.phases)
    variance = result.itf_variance(settings.phases)
    modes = itf_modes(frequency, response, variance, modes=settings.modes)
    # A window's estimates have about as many independent errors as a polynomial has coefficients.
    step = int(result.lines[1] - result.lines[0])
    together = max(1.0, window.width / (window.order + 1) / step)
    accuracy = expected_accuracy(result, cost)
    rule = record_rule(spectra, window.harmonics, window.order, *modes, accuracy.truncation)
    warnings = [*notes, *_warnings(accuracy, rule, spectra)]
    attributes: dict[str, Any] = {
        "method": settings.method,
        "settings": json.dumps(asdict(settings)),
        "harmonics": window.harmonics,
        "order": window.order,
        "window": window.half_width,
        "transient": "estimated" if window.transient else "none",
        "unknowns": result.unknowns,
        "equations": result.equations,
        "windows": result.windows,
        "condition_number": result.condition,
        "residual": result.residual,
        "variance_error": accuracy.variance,
        "truncation_error": accuracy.truncation,
        "record_error": accuracy.record,
        "expected_error": accuracy.expected,
        "expected_error_bound": accuracy.bound,
        "variance_sampled": result.variance_sampled,
        "variance_cross_terms": result.cross_terms,
        **_about(spectra),
        "warnings": "\n".join(warnings),
    }
    if rule is not None:
        attributes |= {
            "record_duration": rule.duration,
            "record_needed": rule.needed,
            "bandwidth": rule.bandwidth,
            "harmonics_needed": rule.harmonics_needed,
        }
    return make_frf(
        "identified",
        frequency=frequency,
        itf=response,
        htf=result.htf,
        modes=modes,
        itf_variance=variance,
        htf_variance=result.htf_variance,
        coherence=result.coherence,
        natural_frequency_sd=natural_frequency_deviation(frequency, response, variance, modes, together),
        attributes=attributes,
    )


def _about(spectra: Spectra) -> dict[str, Any]:
    return {
        "mesh_frequency": spectra.mesh_lines * spectra.spacing,
        "mesh_lines": spectra.mesh_lines,
        "realisations": spectra.realisations,
        "joint_period": spectra.duration,
        "periods_averaged": spectra.periods,
    }


def _warnings(accuracy: Accuracy, rule: RecordRule | None, spectra: Spectra) -> list[str]:
    notes = []
    if accuracy.expected >= 1.0:
        notes.append(
            f"the expected error of {accuracy.expected:.0%} exceeds the response: this result says nothing; is the"
            f" mesh period of {1.0 / (spectra.mesh_lines * spectra.spacing):g} s right?"
        )
    if accuracy.expected > DOUBTFUL:
        doubtful = f", doubtful channels {accuracy.record:.0%}" if accuracy.record else ""
        notes.append(
            f"expected error of the ITF: {accuracy.expected:.0%} (variance {accuracy.variance:.0%}, missing branches"
            f" {accuracy.truncation:.0%}{doubtful}); nothing has been smoothed"
        )
    if rule is not None:
        lacking = accuracy.truncation > MISSING and rule.harmonics < rule.harmonics_needed
        if rule.factor > 1:
            branches = rule.harmonics_needed if lacking else rule.harmonics
            notes.append(
                f"the record is short by a factor of {rule.factor:.3g}: {spectra.realisations} realisation(s) give"
                f" {rule.duration:g} s of distinct excitation, {branches} branches a side and a bandwidth of"
                f" {rule.bandwidth:.3g} Hz ask for {rule.needed:.3g} s"
            )
        if lacking:
            notes.append(
                f"{rule.harmonics} branches a side reach less far than the first mode travels;"
                f" {rule.harmonics_needed} would"
            )
    return notes
