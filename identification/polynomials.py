"""A task by the local polynomial method: branches, order and window chosen, the result as a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from gearbench.identification.lpm.accuracy import MISSING, Accuracy, RecordRule, expected_accuracy, record_rule
from gearbench.identification.lpm.at_varying import polynomials_at_varying_speed
from gearbench.identification.lpm.estimate import LpmResult, local_polynomial
from gearbench.identification.lpm.limits import Limits, limits_of
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.lpm.regression import Window
from gearbench.identification.lpm.selection import choose_window
from gearbench.identification.response.frf import make_frf
from gearbench.identification.response.mode_spread import natural_frequency_deviation
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.spectra.course import Course
from gearbench.identification.spectra.joint import Spectra
from gearbench.identification.task import Task
from gearbench.identification.truth.periodic import itf_from_htf

# Results beyond this expected error carry a warning.
DOUBTFUL = 0.1


def by_polynomials(task: Task) -> xr.Dataset:
    """Dataset of kind "identified". Raises LpmError for what the record does not support."""
    settings, spectra = task.settings, task.spectra
    transient = settings.transient == "estimate" or (settings.transient == "auto" and not spectra.steady)
    task.report(0.1, "choosing branches, order and window")
    window = choose_window(
        spectra,
        task.lines,
        transient=transient,
        harmonics=settings.harmonics,
        order=settings.order,
        half_width=settings.window,
    )
    result = local_polynomial(spectra, task.lines, window, progress=task.part(0.2, 0.7))
    task.report(0.9, "modes")
    return _dataset(task, window, result)


def by_polynomials_at_varying_speed(task: Task, course: Course) -> xr.Dataset:
    """The same of records whose speed varies, at the mean mesh frequency. Raises LpmError likewise."""
    settings = task.settings
    if settings.transient == "none":
        raise LpmError("transient = 'none' belongs to a constant speed; at one that varies it is always estimated")
    task.report(0.1, "choosing branches, order and window at a speed that varies")
    result, window, free = polynomials_at_varying_speed(
        task.spectra,
        course,
        task.lines,
        harmonics=settings.harmonics,
        order=settings.order,
        half_width=settings.window,
        progress=task.part(0.2, 0.7),
    )
    task.report(0.9, "modes")
    speeds = (task.spectra.mesh_lines + np.array([course.shift.min(), course.shift.max()])) * task.spectra.spacing
    return _dataset(task, window, result).assign_attrs(
        speed="varying",
        mesh_frequency_lowest=float(speeds[0]),
        mesh_frequency_highest=float(speeds[1]),
        operating_response="free" if free else "as noise",
    )


def _dataset(task: Task, window: Window, result: LpmResult) -> xr.Dataset:
    settings, spectra = task.settings, task.spectra
    frequency = np.asarray(result.lines * spectra.spacing, dtype=float)
    response = itf_from_htf(result.htf, settings.phases)
    variance = result.itf_variance(settings.phases)
    modes = itf_modes(frequency, response, variance, modes=settings.modes)
    # A window's estimates have about as many independent errors as a polynomial has coefficients.
    step = int(result.lines[1] - result.lines[0])
    together = max(1.0, window.width / (window.order + 1) / step)
    accuracy = expected_accuracy(result, task.record_error)
    limits = limits_of(result, accuracy)
    rule = record_rule(spectra, window.harmonics, window.order, *modes, accuracy.truncation)
    attributes = task.attributes() | _about_fit(window, result, accuracy, limits)
    if rule is not None:
        attributes |= {
            "record_duration": rule.duration,
            "record_needed": rule.needed,
            "bandwidth": rule.bandwidth,
            "harmonics_needed": rule.harmonics_needed,
        }
    attributes["warnings"] = "\n".join([*task.notes, *_warnings(accuracy, limits, rule, spectra, task.simulated)])
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


def _about_fit(window: Window, result: LpmResult, accuracy: Accuracy, limits: Limits) -> dict[str, Any]:
    """Attributes that say what was fitted, and how well."""
    return {
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
        "noise_error": limits.noise,
        "branches_error": limits.branches,
        "window_error": limits.window,
        "limited_by": limits.largest,
        "variance_sampled": result.variance_sampled,
        "variance_cross_terms": result.cross_terms,
    }


def _warnings(
    accuracy: Accuracy, limits: Limits, rule: RecordRule | None, spectra: Spectra, simulated: bool
) -> list[str]:
    notes = []
    if accuracy.expected >= 1.0:
        period = 1.0 / (spectra.mesh_lines * spectra.spacing)
        help_ = "more realisations help" if simulated else f"is the mesh period of {period:g} s right?"
        notes.append(
            f"the expected error of {accuracy.expected:.0%} exceeds the response: this result says nothing; {help_}"
        )
    if accuracy.expected > DOUBTFUL:
        doubtful = f", doubtful channels {accuracy.record:.0%}" if accuracy.record else ""
        notes.append(
            f"expected error of the ITF: {accuracy.expected:.0%} (noise {limits.noise:.0%}, missing branches"
            f" {limits.branches:.0%}, polynomials that do not follow {limits.window:.0%}{doubtful}); nothing has been"
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
