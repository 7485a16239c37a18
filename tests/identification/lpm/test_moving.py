"""The local polynomial method at a speed that varies: closed forms, and the reference system."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from shared.known_branches import GAIN, LINES, SLOPE, known
from shared.reference_rig import ReferenceRig
from shared.varying_rig import truth_at, varying_record, wandering

from gearbench.identification import IdentificationSettings, LpmError, SpectraError, identify, is_coset, itf
from gearbench.identification.lpm import at_varying, moving
from gearbench.identification.spectra.course import course_spectra, speed_varies
from gearbench.identification.spectra.joint import Spectra


def errors(record: xr.Dataset, operating: bool) -> float:
    """Largest error of the branches -2..2 relative to branch 0's."""
    spectra, course = course_spectra([record])
    free = moving.prepare_moving(spectra, course, harmonics=2, order=1, half_width=24, operating=operating)
    found = at_varying.local_polynomial(spectra, LINES, at_varying.Window(2, 1, 24, transient=True), regression=free)
    speed = spectra.mesh_lines * spectra.spacing
    wanted = []
    for branch in range(-2, 3):
        middle = 2j * np.pi * (LINES * spectra.spacing + branch * speed / 2)
        gain, slope = GAIN[abs(branch)], SLOPE[abs(branch)]
        wanted.append(
            (np.conj(gain) if branch < 0 else gain) + (np.conj(slope) if branch < 0 else slope) * middle
        )
    return float(np.abs(found.htf - np.array(wanted)).max() / np.abs(wanted[2]).max())


def test_branches_of_a_known_operator_are_exact_at_any_speed() -> None:
    assert errors(known(), False) < 1e-4


def test_an_operating_response_that_sweeps_through_the_lines_is_left_free() -> None:
    """As large as the response itself: as noise it costs a tenth, left free nothing that its ends do not make."""
    record = known(operating=2e-6)
    as_noise, free = errors(record, False), errors(record, True)
    assert as_noise > 0.01
    assert free < 0.1 * as_noise


@pytest.mark.validation
def test_a_wander_of_a_fifth_costs_what_is_expected() -> None:
    """Half a second of one realisation of the reference system, 40 dB, by DOP853."""
    rig = ReferenceRig(mesh_frequency=60.0, edge=0.2)
    given = {"duration": 0.5, "rate": 6000.0, "band": (2.0, 2000.0), "noise": 0.01, "tolerance": 1e-5}
    wander = varying_record(rig, wandering(60.0, 0.5), **given)
    settings = IdentificationSettings(
        harmonics=4, order=2, window=40, band=(700.0, 1700.0), phases=32, modes=1, step=10
    )
    found = identify([wander], settings)
    exact = truth_at(rig, found)
    error = float(np.linalg.norm(itf(found).values - exact) / np.linalg.norm(exact))
    assert error < 0.35
    assert 0.5 < found.attrs["expected_error"] / error < 2.0
    assert found.attrs["speed"] == "varying" and found.attrs["method"] == "lpm"
    assert found.attrs["mesh_frequency_lowest"] == pytest.approx(48.0, rel=0.02)
    assert found.attrs["mesh_frequency_highest"] == pytest.approx(72.0, rel=0.02)


def test_what_cannot_be_done_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    wander = known()  # a filter that takes work from nowhere, which is doubtful
    assert not is_coset([wander])
    with pytest.raises(LpmError, match="transient = 'none' belongs to a constant speed"):
        identify([wander], IdentificationSettings(accept_doubts=True, transient="none"))
    with pytest.raises(LpmError, match="order = 5 must be at most 4"):
        identify([wander], IdentificationSettings(accept_doubts=True, order=5))
    with pytest.raises(LpmError, match="under-determined"):
        identify([wander], IdentificationSettings(accept_doubts=True, harmonics=20, order=2, window=10))
    monkeypatch.setattr(moving, "BYTES", 1e6)
    with pytest.raises(LpmError, match=r"harmonics = 8 .* more than 0.001 GB; at most \d+ fit"):
        identify([wander], IdentificationSettings(accept_doubts=True, harmonics=8))
    slow = wander.assign(mesh_phase=wander["mesh_phase"] * 0.04)
    assert speed_varies([slow], 0.01)
    with pytest.raises(SpectraError, match=r"holds 1\.57 mesh periods; at a speed that varies at least 2"):
        course_spectra([slow])


def test_fewer_branches_are_tried_where_the_chosen_ones_do_not_fit_all_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    spectra, course = course_spectra([known()])
    whole, asked = at_varying.local_polynomial, []

    def picky(spectra: Spectra, lines: Any, window: at_varying.Window, **how: Any) -> Any:
        asked.append(window.harmonics)
        if window.harmonics > 1:
            raise LpmError("under-determined")
        return whole(spectra, lines, window, **how)

    monkeypatch.setattr(at_varying, "local_polynomial", picky)
    chosen = {"order": 1, "half_width": 24}
    _, window, _ = at_varying.polynomials_at_varying_speed(spectra, course, LINES, harmonics=None, **chosen)
    assert window.harmonics == asked[-1] <= 1 < asked[0]
    assert asked == sorted(asked, reverse=True)
    with pytest.raises(LpmError, match="under-determined"):
        at_varying.polynomials_at_varying_speed(spectra, course, LINES, harmonics=2, **chosen)
