"""Smooth branches at a speed that varies: delays against the closed form, a known operator, constant speed."""

from dataclasses import replace

import numpy as np
import pytest
from shared.known_branches import GAIN, LINES, MESH, RATE, SIZE, SLOPE, delayed, known

from gearbench.identification import IdentificationSettings, LpmError, htf, identify
from gearbench.identification.lpm.regression import prepare
from gearbench.identification.smooth import at_varying
from gearbench.identification.smooth.estimate import SmoothModel, window_equations
from gearbench.identification.smooth.posterior import correlation
from gearbench.identification.smooth.turned import POWERS, delays_for, span_of, turned
from gearbench.identification.smooth.turned_posterior import turned_equations
from gearbench.identification.spectra.course import course_spectra


@pytest.mark.parametrize("span", [10.0, 60.0, 200.0])
def test_delays_correlate_like_branches_that_decay(span: float) -> None:
    lines = np.linspace(-span, span, 201)
    delays = delays_for(20.0, span, 4096)
    assert np.abs(delays.turn(lines) @ delays.weights - correlation(lines, 20.0)).max() < 5e-4


def test_rows_at_constant_speed_covary_as_at_constant_speed() -> None:
    """Second formulation: k o (U U^H) of every branch from shifted lines, against turned and delayed forces."""
    time = np.arange(SIZE) / 4096.0
    record = known().assign(mesh_phase=(("realisation", "time"), MESH * time[None]))
    spectra, course = course_spectra([record])
    harmonics, width, bandwidth, centre = 2, 20, 30.0, 300
    delays = delays_for(bandwidth, span_of(course, harmonics, width), SIZE)
    found = turned_equations(spectra, turned(spectra, course, harmonics, delays, width), centre, width)
    regression = prepare(spectra, transient=True, reach=harmonics * spectra.mesh_lines)
    model = SmoothModel(harmonics, width, bandwidth, transient=True)
    # Lines of the operating response are left out there.
    equations = window_equations(regression, centre, model)
    assert equations is not None
    rows = (equations.offset + width).astype(int)
    near = correlation(equations.offset[:, None] - equations.offset, bandwidth)
    for branch in range(2 * harmonics + 1):
        own = found.columns[rows, branch]
        wanted = near * np.outer(equations.columns[:, branch], equations.columns[:, branch].conj())
        assert np.abs(own @ own.conj().T - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_a_known_operator_is_found_at_a_wandering_speed_under_an_operating_response(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Branches -2..2 in closed form; the operating response is as large as the response itself."""
    monkeypatch.setattr(at_varying, "ROWS", 160)
    settings = IdentificationSettings(
        accept_doubts=True,  # of a filter that takes work from nowhere
        harmonics=2, band=(300.0, 900.0), phases=16, modes=0, step=30, branches="smooth"
    )
    frf = identify([known(operating=2e-6)], settings)
    assert frf.attrs["branches"] == "smooth" and frf.attrs["speed"] == "varying"
    assert frf.attrs["operating_response"] == "free" and "order" not in frf.attrs
    branch = np.arange(-2, 3)
    gain, slope = (np.array([np.conj(x[-l]) if l < 0 else x[l] for l in branch]) for x in (GAIN, SLOPE))  # noqa: E741
    middle = 2j * np.pi * (frf.frequency.values + branch[:, None] * frf.attrs["mesh_frequency"] / 2)
    wanted = gain[:, None] + slope[:, None] * middle
    assert np.abs(htf(frf).values - wanted).max() < 0.02 * np.abs(wanted[2]).max()
    assert frf.attrs["variance_error"] < 0.05 and frf.attrs["truncation_error"] < 0.01


def test_a_delay_turns_half_of_the_phase_before_and_half_after(monkeypatch: pytest.MonkeyPatch) -> None:
    """Branches that are pure delays of 5 ms: turned in another order branch 2 would be 0.2 cycles off."""
    monkeypatch.setattr(at_varying, "ROWS", 160)
    lag = 20
    settings = IdentificationSettings(
        harmonics=2, band=(300.0, 900.0), phases=16, modes=0, step=30, branches="smooth", accept_doubts=True
    )
    frf = identify([delayed(lag)], settings)
    branch = np.arange(-2, 3)
    gain = np.array([np.conj(GAIN[-l]) if l < 0 else GAIN[l] for l in branch])  # noqa: E741
    middle = frf.frequency.values + branch[:, None] * frf.attrs["mesh_frequency"] / 2
    wanted = gain[:, None] * np.exp(-2j * np.pi * middle * lag / RATE)
    assert np.abs(htf(frf).values - wanted).max() < 0.02 * np.abs(wanted[2]).max()


def test_records_that_leave_too_narrow_windows_are_refused() -> None:
    spectra, course = course_spectra([known()])
    many = replace(spectra, force=np.repeat(spectra.force, 60, axis=0), dte=np.repeat(spectra.dte, 60, axis=0))
    with pytest.raises(LpmError, match="60 realisations leave windows of n = 3 lines, less than the 6"):
        at_varying.smooth_at_varying_speed(many, course, LINES, harmonics=2, progress=lambda part, message: None)


def test_powers_of_the_departure_begin_with_the_branch_itself() -> None:
    """At half of the largest departure the second column is half of the first."""
    spectra, course = course_spectra([known()])
    level = replace(course, shift=np.where(np.arange(SIZE) == SIZE - 1, 2.0, 1.0) * np.ones_like(course.shift))
    own = turned(spectra, level, 1, delays_for(30.0, 60.0, SIZE), 10)
    assert own.branches.shape[0] == POWERS
    first, second = own.branches[0], own.branches[1]
    assert np.abs(second - 0.5 * first).max() < 2e-3 * np.abs(first).max()
