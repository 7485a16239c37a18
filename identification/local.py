"""A task by the local method: polynomials or smooth branches, their numbers chosen, the result as a dataset.

Polynomials cost (2L+1)(R+1) equations a window, which a short record does not have; smooth branches (`smooth/`) cost
what the data say of them, and processor time. They are tried where polynomials expect to err by more than ENOUGH; the
one that expects to err less is the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from gearbench.identification.lpm.accuracy import MISSING, Accuracy, RecordRule, expected_accuracy, record_rule
from gearbench.identification.lpm.at_varying import polynomials_at_varying_speed
from gearbench.identification.lpm.estimate import LpmResult, local_polynomial, require_lines
from gearbench.identification.lpm.limits import Limits, limits_of
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.regression import Window
from gearbench.identification.lpm.selection import choose_window
from gearbench.identification.response.frf import make_frf
from gearbench.identification.response.mode_spread import natural_frequency_deviation
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.smooth.at_varying import smooth_at_varying_speed
from gearbench.identification.smooth.choice import choose_smooth
from gearbench.identification.smooth.estimate import smooth_branches
from gearbench.identification.spectra.course import Course
from gearbench.identification.spectra.joint import Spectra
from gearbench.identification.task import Task
from gearbench.identification.truth.periodic import itf_from_htf

# Results beyond this expected error carry a warning.
DOUBTFUL = 0.1
# Expected error of polynomials beyond which smooth branches are tried as well.
ENOUGH = 0.01
# Part of the band's lines below which an excitation leaves classes of lines empty, and of the strongest line's force
# below which a line counts as left out: a measured torque is never without noise.
SPARSE, LEFT_OUT = 0.4, 0.03


@dataclass(frozen=True)
class Fitted:
    """What was fitted, as the result says it: branches a side, order of the polynomials or None, half-width [lines],
    bandwidth [lines] of smooth branches or None, estimated transient."""

    harmonics: int
    order: int | None
    half_width: int
    bandwidth: float | None
    transient: bool

    @property
    def alike(self) -> float:
        """Lines whose estimates err together: a window has about as many independent errors as a polynomial has
        coefficients, a smooth function one in pi B lines."""
        if self.bandwidth is not None:
            return float(np.pi * self.bandwidth)
        return (2 * self.half_width + 1) / ((self.order or 0) + 1)


def by_local_method(task: Task) -> xr.Dataset:
    """Dataset of kind "identified", by polynomials or by smooth branches. Raises LpmError for what the record does not
    support."""
    settings, spectra = task.settings, task.spectra
    transient = settings.transient == "estimate" or (settings.transient == "auto" and not spectra.steady)
    prescribed = (settings.harmonics, settings.order, settings.window) != (None, None, None)
    if settings.harmonics is not None:
        # Before anything is built for branches that no line holds.
        require_lines(spectra, task.lines, Window(settings.harmonics, 0, settings.window or 0, transient))
    if settings.branches == "smooth":
        found = _by_smooth_branches(task, transient)
    elif settings.branches == "polynomials" or prescribed:
        found = _by_polynomials(task, transient)
    else:
        found = _by_the_better(task, transient)
    task.report(0.9, "modes")
    return _dataset(task, *found)


def _by_the_better(task: Task, transient: bool) -> tuple[Fitted, LpmResult]:
    """Polynomials, and where they expect to err by more than ENOUGH the better of them and of smooth branches. Where
    the force leaves most lines out no residual shows what polynomials miss between them: smooth branches alone, if
    they can be had."""
    found, refused = [], ""
    if _sparse(task):
        try:
            return _by_smooth_branches(task, transient)
        except LpmError as error:
            refused = str(error)
    try:
        found.append(_by_polynomials(task, transient))
    except LpmError as error:
        refused = str(error)
    if not found or _expects(found[0]) > ENOUGH:
        try:
            found.append(_by_smooth_branches(task, transient))
        except LpmError:
            if not found:
                raise LpmError(refused) from None
    return min(found, key=_expects)


def _sparse(task: Task) -> bool:
    """Whether the force excites less than SPARSE of the lines of its band, as a coset multisine does."""
    spectra = task.spectra
    low, high = (round(end / spectra.spacing) for end in task.excited)
    size = np.abs(spectra.force[:, max(low, 1) : high + 1]).max(axis=0)
    excited = np.count_nonzero(size > LEFT_OUT * size.max(initial=0.0))
    return excited * spectra.repeats < SPARSE * size.size


def _expects(found: tuple[Fitted, LpmResult]) -> float:
    """Expected error of a result."""
    return expected_accuracy(found[1]).expected


def _by_polynomials(task: Task, transient: bool) -> tuple[Fitted, LpmResult]:
    """Polynomials of what is given and the best choice of the rest. Raises LpmError."""
    settings = task.settings
    task.report(0.1, "choosing branches, order and window")
    window = choose_window(
        task.spectra,
        task.lines,
        transient=transient,
        harmonics=settings.harmonics,
        order=settings.order,
        half_width=settings.window,
    )
    result = local_polynomial(task.spectra, task.lines, window, progress=task.part(0.15, 0.25))
    return Fitted(window.harmonics, window.order, window.half_width, None, transient), result


def _by_smooth_branches(task: Task, transient: bool) -> tuple[Fitted, LpmResult]:
    """Smooth branches with the best choice of bandwidth and number. Raises LpmError."""
    task.report(0.4, "choosing bandwidth and number of smooth branches")
    model = choose_smooth(task.spectra, task.lines, transient=transient, harmonics=task.settings.harmonics)
    result = smooth_branches(task.spectra, task.lines, model, progress=task.part(0.5, 0.4))
    return Fitted(model.harmonics, None, model.half_width, model.bandwidth, transient), result


def by_local_method_at_varying_speed(task: Task, course: Course) -> xr.Dataset:
    """The same of records whose speed varies, at the mean mesh frequency. Raises LpmError likewise."""
    settings = task.settings
    if settings.transient == "none":
        raise LpmError("transient = 'none' belongs to a constant speed; at one that varies it is always estimated")
    prescribed = (settings.harmonics, settings.order, settings.window) != (None, None, None)
    said: dict[str, str] = {}
    found, refused = [], ""
    if settings.branches != "smooth":
        try:
            fitted, result, operating = _polynomials_with(task, course)
            found.append((fitted, result))
            said["operating_response"] = operating
        except LpmError as error:
            refused = str(error)
    if settings.branches == "smooth" or (
        settings.branches == "auto" and not prescribed and (not found or _expects(found[0]) > ENOUGH)
    ):
        try:
            found.append(_smooth_with(task, course))
        except LpmError as error:
            refused = refused or str(error)
    if not found:
        raise LpmError(refused)
    best = min(found, key=_expects)
    if best[0].bandwidth is not None:
        said["operating_response"] = "free"
    task.report(0.9, "modes")
    speeds = (task.spectra.mesh_lines + np.array([course.shift.min(), course.shift.max()])) * task.spectra.spacing
    return _dataset(task, *best).assign_attrs(
        speed="varying",
        mesh_frequency_lowest=float(speeds[0]),
        mesh_frequency_highest=float(speeds[1]),
        **said,
    )


def _polynomials_with(task: Task, course: Course) -> tuple[Fitted, LpmResult, str]:
    """Polynomials at a speed that varies, and what became of the operating response. Raises LpmError."""
    task.report(0.1, "choosing branches, order and window at a speed that varies")
    result, window, free = polynomials_at_varying_speed(
        task.spectra,
        course,
        task.lines,
        harmonics=task.settings.harmonics,
        order=task.settings.order,
        half_width=task.settings.window,
        progress=task.part(0.2, 0.2),
    )
    fitted = Fitted(window.harmonics, window.order, window.half_width, None, True)
    return fitted, result, "free" if free else "as noise"


def _smooth_with(task: Task, course: Course) -> tuple[Fitted, LpmResult]:
    """Smooth branches at a speed that varies. Raises LpmError."""
    task.report(0.4, "choosing bandwidth and number of smooth branches at a speed that varies")
    result, model = smooth_at_varying_speed(
        task.spectra, course, task.lines, harmonics=task.settings.harmonics, progress=task.part(0.4, 0.5)
    )
    return Fitted(model.harmonics, None, model.half_width, model.bandwidth, True), result


def _dataset(task: Task, fitted: Fitted, result: LpmResult) -> xr.Dataset:
    settings, spectra = task.settings, task.spectra
    frequency = np.asarray(result.lines * spectra.spacing, dtype=float)
    response = itf_from_htf(result.htf, settings.phases)
    variance = result.itf_variance(settings.phases)
    modes = itf_modes(frequency, response, variance, modes=settings.modes)
    together = max(1.0, fitted.alike / int(result.lines[1] - result.lines[0]))
    accuracy = expected_accuracy(result, task.record_error)
    limits = limits_of(result, accuracy)
    rule = None
    if fitted.order is not None:
        rule = record_rule(spectra, fitted.harmonics, fitted.order, *modes, accuracy.truncation)
    attributes = task.attributes() | _about_fit(fitted, spectra, result, accuracy, limits)
    if rule is not None:
        attributes |= {
            "record_duration": rule.duration,
            "record_needed": rule.needed,
            "bandwidth": rule.bandwidth,
            "harmonics_needed": rule.harmonics_needed,
        }
    attributes["warnings"] = "\n".join([*task.notes, *_warnings(fitted, accuracy, limits, rule, task)])
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


def _about_fit(
    fitted: Fitted, spectra: Spectra, result: LpmResult, accuracy: Accuracy, limits: Limits
) -> dict[str, Any]:
    """Attributes that say what was fitted, and how well."""
    return {
        "branches": "polynomials" if fitted.bandwidth is None else "smooth",
        "harmonics": fitted.harmonics,
        "order": fitted.order,
        "window": fitted.half_width,
        "smooth_bandwidth": None if fitted.bandwidth is None else fitted.bandwidth * spectra.spacing,
        "transient": "estimated" if fitted.transient else "none",
        "unknowns": result.unknowns,
        "equations": result.equations,
        "windows": result.windows,
        "condition_number": None if fitted.bandwidth is not None else result.condition,
        "residual": result.residual,
        "variance_error": accuracy.variance,
        "truncation_error": accuracy.truncation,
        "record_error": accuracy.record,
        "expected_error": accuracy.expected,
        "expected_error_bound": accuracy.bound,
        "noise_error": limits.noise,
        "branches_error": limits.branches,
        "window_error": limits.window,
        "limited_by": limits.largest,
        "variance_sampled": result.variance_sampled,
        "variance_cross_terms": result.cross_terms,
    }


def _warnings(fitted: Fitted, accuracy: Accuracy, limits: Limits, rule: RecordRule | None, task: Task) -> list[str]:
    notes, spectra = [], task.spectra
    if fitted.bandwidth is None and _sparse(task):
        notes.append(
            "the force leaves most lines of its band out: what polynomials miss between those that it excites is in no"
            " residual, and not in the expected error; smooth branches count it"
        )
    if accuracy.expected >= 1.0:
        period = 1.0 / (spectra.mesh_lines * spectra.spacing)
        notes.append(
            f"the expected error of {accuracy.expected:.0%} exceeds the response: this result says nothing; more"
            f" realisations help if the mesh period of {period:g} s is right"
        )
    if accuracy.expected > DOUBTFUL:
        doubtful = f", doubtful channels {accuracy.record:.0%}" if accuracy.record else ""
        notes.append(
            f"expected error of the ITF: {accuracy.expected:.0%} (noise {limits.noise:.0%}, missing branches"
            f" {limits.branches:.0%}, what windows leave open {limits.window:.0%}{doubtful}); nothing has been"
            " smoothed"
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
