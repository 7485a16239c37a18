"""Identification of a time-varying frequency response from records: the one public function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from math import pi

import xarray as xr

from gearbench.identification.doubts import doubts_about, require_response
from gearbench.identification.feedback.data import FURTHER, SIDEBANDS, top_line
from gearbench.identification.feedback.estimate import mesh_feedback
from gearbench.identification.feedback.frf import feedback_frf
from gearbench.identification.feedback.varying_frf import signals_of, varying_frf
from gearbench.identification.local import by_local_method, by_local_method_at_varying_speed
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.selection import LADDER
from gearbench.identification.spectra.course import course_spectra, speed_varies
from gearbench.identification.spectra.joint import Spectra, SpectraError, require_mesh_periods
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.task import IdentificationSettings, Progress, Task, attributes_of, output_lines
from gearbench.records.checks import angles_keep_mesh_period, check_record
from gearbench.records.even_speed import LOST, VARIES
from gearbench.records.record import validate_record

# Expected error of mesh-feedback beyond which the local polynomial method is tried as well.
SECOND_OPINION = 0.05
# Sidebands below the excited band's end that a prediction at another mesh frequency follows.
MOST_SIDEBANDS = 5000
# Part that sidebands beyond the fitted lines have in what mesh feedback expects to err by, from which on more are
# fitted.
LEFT_OUT = 0.7
# Equations of mesh-feedback beyond which further realisations are left out.
ENOUGH = 20_000


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
    error; where it costs too much, or the result would say nothing, RecordError or LpmError unless
    `settings.accept_doubts`.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=2"]))
    >>> settings = gb.IdentificationSettings(harmonics=8, order=1, window=12, band=(500.0, 1500.0))
    >>> frf = gb.identify([record], settings)
    >>> dict(frf["itf_re"].sizes), frf["itf_re"].attrs["units"]
    ({'frequency': 501, 'phase': 256}, 'm/N')
    >>> f"{frf.attrs['expected_error']:.0%}"
    '12%'
    """
    frf = _identified(records, settings or IdentificationSettings(), progress or (lambda fraction, message: None))
    teeth = records[0].attrs.get("teeth_driver")
    if teeth and "switch_phases" in frf.attrs:
        frf.attrs["switch_angles_driver"] = [2 * pi * float(phase / teeth) for phase in frf.attrs["switch_phases"]]
    if not (settings or IdentificationSettings()).accept_doubts:
        require_response(frf)
    return frf


def _identified(records: Sequence[xr.Dataset], settings: IdentificationSettings, report: Progress) -> xr.Dataset:
    """As `identify`, whatever is to be expected of the result."""
    report(0.0, "spectra")
    for record in records:
        validate_record(record)
    if settings.method == "mesh-feedback" and speed_varies(records):
        if settings.mesh_frequency is not None:
            raise LpmError(
                f"mesh_frequency = {settings.mesh_frequency:g} Hz is predicted from records of constant speed only; the"
                " speed of this record varies"
            )
        return _feedback_at_varying_speed(records, settings, report)
    if _not_averaged(records):
        return _local_at_varying_speed(records, settings, report)
    sidebands = settings.harmonics if settings.harmonics is not None else LADDER[-1]
    try:
        spectra, excited, notes = record_spectra(
            records, top=settings.band[1] if settings.band else None, sidebands=sidebands
        )
    except SpectraError:
        # A mesh period that the angles contradict says more than that the record's length is unlucky.
        for record in records:
            check_record(record, checks=[angles_keep_mesh_period])
        raise
    require_mesh_periods(spectra)
    report(0.05, "what the records say about themselves")
    doubts, cost = doubts_about(records, settings)
    said = [*doubts, *notes]
    return identify_spectra(spectra, excited, settings, notes=said, record_error=cost, progress=report)


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
    task = Task(spectra, lines, settings, excited, tuple(notes), record_error, report)
    if settings.method == "mesh-feedback":
        frf = by_feedback(task)
        # Another method knows no other mesh frequency than the record's.
        if frf.attrs["expected_error"] > SECOND_OPINION and settings.mesh_frequency is None:
            alone = replace(task, settings=_as_polynomials(settings))
            frf = _second_opinion(frf, partial(by_local_method, alone))
    else:
        frf = by_local_method(task)
    report(1.0, "identified")
    return frf


def by_feedback(task: Task) -> xr.Dataset:
    """Dataset of kind "identified" by mesh feedback alone. Raises LpmError for what the record does not support."""
    highest, realisations = round(task.excited[1] / task.spectra.spacing), task.spectra.realisations
    least, wanted = task.excited[1] / MOST_SIDEBANDS, task.settings.mesh_frequency
    if wanted is not None and wanted < least:
        raise LpmError(
            f"mesh_frequency = {wanted:g} Hz must be at least {least:.3g} Hz: {MOST_SIDEBANDS} sidebands to the end of"
            f" the excited band, {task.excited[1]:g} Hz, are followed"
        )
    kept = min(realisations, max(1, -(-ENOUGH // highest)))
    if kept < realisations:
        said = f"mesh-feedback uses the first {kept} of {realisations} realisations: they are enough"
        task = replace(task.first_realisations(kept), notes=(*task.notes, said))
    frf = _feedback_with(task, highest, SIDEBANDS)
    further = top_line(task.spectra, highest, FURTHER) > top_line(task.spectra, highest, SIDEBANDS)
    left_out = frf.attrs["sidebands_error"] > LEFT_OUT * frf.attrs["expected_error"]
    # From angles alone fits that take in more sidebands end in poorer minima (2.7 % in place of 0.9 %).
    if further and left_out and not task.spectra.angle_only:
        frf = min((frf, _feedback_with(task, highest, FURTHER)), key=lambda frf: frf.attrs["expected_error"])
    return frf


def _feedback_with(task: Task, highest: int, sidebands: int) -> xr.Dataset:
    """Mesh feedback from lines up to so many `sidebands` beyond the `highest` excited one."""
    found = mesh_feedback(
        task.spectra, highest, harmonics=task.settings.harmonics, sidebands=sidebands, progress=task.part(0.1, 0.6)
    )
    task.report(0.7, "response of the mesh-feedback model")
    return feedback_frf(
        task.spectra,
        task.lines,
        found,
        phases=task.settings.phases,
        modes=task.settings.modes,
        notes=list(task.notes),
        record=task.record_error,
        attributes=task.attributes(),
        mesh_frequency=task.settings.mesh_frequency,
    )


def _feedback_at_varying_speed(
    records: Sequence[xr.Dataset], settings: IdentificationSettings, report: Progress
) -> xr.Dataset:
    """Mesh feedback with the measured phase."""
    doubts, cost = doubts_about(records, settings)
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
        attributes=attributes_of(settings, spectra),
        progress=lambda part, message: report(0.1 + 0.6 * part, message),
    )
    if frf.attrs["expected_error"] > SECOND_OPINION:
        frf = _second_opinion(frf, lambda: _identified(records, _as_polynomials(settings), lambda part, message: None))
    report(1.0, "identified")
    return frf


def _not_averaged(records: Sequence[xr.Dataset]) -> bool:
    """Whether the speed varies, and more than averages over excitation periods bear if there are any."""
    repeated = any(int(record.attrs.get("periods", 1)) > 1 for record in records)
    return speed_varies(records, LOST if repeated else VARIES)


def _local_at_varying_speed(
    records: Sequence[xr.Dataset], settings: IdentificationSettings, report: Progress
) -> xr.Dataset:
    """The local method with the measured phase."""
    doubts, cost = doubts_about(records, settings)
    spectra, course = course_spectra(records, settings.harmonics)
    excited = (course.lowest * spectra.spacing, course.excited * spectra.spacing)
    lines = output_lines(spectra, settings.band or excited, excited, settings.step)
    task = Task(spectra, lines, settings, excited, tuple(doubts), cost, report)
    frf = by_local_method_at_varying_speed(task, course)
    report(1.0, "identified")
    return frf


def _as_polynomials(settings: IdentificationSettings) -> IdentificationSettings:
    return replace(settings, method="lpm", harmonics=None)


def _second_opinion(frf: xr.Dataset, polynomials: Callable[[], xr.Dataset]) -> xr.Dataset:
    """The local polynomial method's result where it expects to err less, else `frf`; both say so."""
    expected = frf.attrs["expected_error"]
    try:
        other = polynomials()
    except (LpmError, SpectraError):
        return frf
    if other.attrs["expected_error"] >= expected:
        return frf
    parts = {"variance": "variance", "truncation": "branches left out", "unexplained": "unexplained"}
    named = ", ".join(f"{words} {frf.attrs[f'{name}_error']:.1%}" for name, words in parts.items())
    said = f"mesh-feedback expects to err by {expected:.1%} here ({named})"
    other.attrs["warnings"] = "\n".join(
        [f"{said}: this is the result of the local polynomial method instead", other.attrs["warnings"]]
    ).strip()
    return other
