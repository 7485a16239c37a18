"""Noise, even and odd distortion: closed forms of polynomials of two tones, linear periodic systems, refusals."""

from math import sqrt

import numpy as np
import pytest
import xarray as xr
from shared.ptv import periodic_filter

from gearbench.identification import DistortionError, SpectraError, distortion, is_coset
from gearbench.identification.excitation.multisine import MultisineError, random_phase_multisine
from gearbench.records.record import make_record

MESH, D = 32, 16  # samples a mesh period, mesh periods an excitation period
SAMPLES = MESH * D
TIME = np.arange(SAMPLES)
SHIFT = 2 * np.pi * TIME / SAMPLES


def record_of(dte: np.ndarray, force: np.ndarray, periods: int = 1, **attributes: float) -> xr.Dataset:
    """Signals (E, periods of SAMPLES) at 1 Hz."""
    given = {"sampling_rate": 1.0, "samples_per_period": SAMPLES, "periods": periods, "mesh_period": float(MESH)}
    given |= {"mesh_phase": 0.0, **attributes}
    return make_record({"dte": dte, "force": force}, given)


def cosets(realisations: int, seed: int = 0, size: float = 1.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    draw = [
        random_phase_multisine(
            SAMPLES, 1.0, (0.0, 0.25), rms=size, grid="coset", modulus=D, rng=rng, crest=2.5
        ) for _ in range(realisations)
    ]  # fmt: skip
    return np.stack([signal.sample(SAMPLES) for signal in draw])


def two_tones(a: float, b: float) -> np.ndarray:
    """Lines D + 1 and 3 D - 1: k1 of class +1 and k2 of class -1."""
    return (a * np.cos((D + 1) * SHIFT) + b * np.cos((3 * D - 1) * SHIFT))[None]


def test_two_tones_through_a_square_have_the_even_distortion_of_the_closed_form() -> None:
    """(a cos k1 + b cos k2)^2: a^2/2, b^2/2 on 2 k1, 2 k2, a b on k1 - k2 (classes +-2), a b on k1 + k2 (class 0)."""
    a, b, e = 1.0, 0.6, 0.02
    u = two_tones(a, b)
    found = distortion([record_of(u + e * u**2, u)], band=(0.0, 0.45))
    rms = found["rms"].sel(part=["operating", "signal", "even", "odd"]).values
    even = e * sqrt((a**4 / 4 + b**4 / 4 + a**2 * b**2) / 2)
    assert rms[:3] == pytest.approx([e * a * b / sqrt(2), sqrt((a**2 + b**2) / 2), even], rel=1e-9)
    assert rms[3] < 1e-12
    assert found.attrs["share"] == pytest.approx(even / sqrt((a**2 + b**2) / 2), rel=1e-9)


def test_two_tones_through_a_cube_tell_what_they_add_to_the_excited_lines() -> None:
    """(z + conj z)^3: classes +-3 hold a^3/4, b^3/4, 3 a^2 b/4, 3 a b^2/4; the excited ones three times that."""
    a, b, e = 1.0, 0.6, 0.02
    u = two_tones(a, b)
    found = distortion([record_of(u + e * u**3, u)], band=(0.0, 0.45))
    odd = e / 4 * sqrt((a**6 + b**6 + 9 * a**4 * b**2 + 9 * a**2 * b**4) / 2)
    assert float(found["rms"].sel(part="odd")) == pytest.approx(odd, rel=1e-9)
    assert float(found["rms"].sel(part="even")) < 1e-12
    lines = np.arange(SAMPLES // 2 + 1)
    cube = np.abs(np.fft.rfft(e * u[0] ** 3) / SAMPLES)[np.isin(lines % D, (1, D - 1))]
    assert found.attrs["odd_inside_rms"] == pytest.approx(sqrt(2 * np.sum(cube**2)), rel=1e-9)


def test_no_line_of_a_linear_periodic_system_leaves_its_class() -> None:
    force = cosets(3) + 2.0
    found = distortion([record_of(periodic_filter(6, MESH).response(force), force)])
    assert found.attrs["share"] < 1e-13
    assert found.attrs["operating_scatter_rms"] < 1e-13 * float(found["rms"].sel(part="signal"))
    assert float(found["rms"].sel(part="operating")) > 0.1 * float(found["rms"].sel(part="signal"))


def test_noise_of_several_periods_is_told_from_distortion() -> None:
    """White noise of rms s leaves s sqrt(lines / all lines / periods); what is below the limit is noise."""
    periods, s = 4, 0.01
    force = np.tile(cosets(5), (1, periods))
    clean = periodic_filter(3, MESH).response(force)
    noise = s * np.random.default_rng(1).standard_normal(force.shape)
    found = distortion([record_of(clean + noise, force, periods)], band=(0.0, 0.4))
    wanted = s * sqrt(0.4 / 0.5 / periods)
    assert found.attrs["noise_rms"] == pytest.approx(wanted, rel=0.05)
    assert (found["rms"] < found["limit"]).sel(part=["even", "odd"]).all()
    signal = float(found["rms"].sel(part="signal"))
    bent = distortion([record_of(clean + noise + 0.05 / signal * clean**2, force, periods)], band=(0.0, 0.4))
    assert float(bent["rms"].sel(part="even")) > 3 * float(bent["limit"].sel(part="even"))
    assert float(bent["rms"].sel(part="odd")) < float(bent["limit"].sel(part="odd"))


def test_even_distortion_is_told_from_the_operating_response_by_size_and_scatter() -> None:
    """y = O + 0.1 u^2: class 0 of u^2 holds sums of lines; one size of u leaves it in the operating response."""
    operating = 0.4 * np.cos(2 * np.pi * TIME / MESH)
    force = cosets(2)
    large, small = (record_of(operating + u + 0.1 * u**2, u) for u in (force, 0.5 * force))
    found = distortion([large], [small], band=(0.0, 0.45))
    lines = np.arange(1, round(0.45 * SAMPLES) + 1)
    even = np.fft.rfft(0.1 * force**2, axis=1)[:, lines[lines % D == 0]] / SAMPLES
    assert found.attrs["operating_alone_rms"] == pytest.approx(0.4 / sqrt(2), rel=1e-9)
    mean = np.abs(even.mean(axis=0))
    assert found.attrs["operating_even_rms"] == pytest.approx(sqrt(2 * np.sum(mean**2)), rel=1e-9)
    scatter = 2 * np.var(even, axis=0, ddof=1).sum()
    assert found.attrs["operating_scatter_rms"] == pytest.approx(sqrt(scatter), rel=1e-9)


def test_realisations_may_begin_at_different_phases() -> None:
    """The same machine a third of a mesh period later: operating lines are turned back, or they would scatter."""
    system, force = periodic_filter(3, MESH), cosets(1) + 1.0
    first = record_of(system.response(force), force)
    later = record_of(system.response(force, start=8), force, mesh_phase=0.25)
    found = distortion([first, later])
    assert found.attrs["operating_scatter_rms"] < 1e-12


def test_what_is_no_coset_is_refused_with_the_reason() -> None:
    rng = np.random.default_rng(0)
    full = random_phase_multisine(SAMPLES, 1.0, (0.01, 0.3), rms=1.0, rng=rng).sample(SAMPLES)[None]
    record = record_of(full, full)
    assert not is_coset([record]) and is_coset([record_of(cosets(1), cosets(1))])
    with pytest.raises(DistortionError, match=r"lines \+-1 .* line 6 is excited"):
        distortion([record])
    comb = cosets(1)
    with pytest.raises(DistortionError, match="here they are 4"):
        distortion([record_of(comb, comb).assign_attrs(mesh_period=128.0)])
    coset = record_of(comb, comb)
    with pytest.raises(DistortionError, match=r"differ in size by a factor of 1;.*1\.2"):
        distortion([coset], [coset])
    with pytest.raises(SpectraError, match="constant"):
        distortion([record_of(comb, np.ones_like(comb))])


def test_a_distorted_force_is_said() -> None:
    u = two_tones(1.0, 0.6)
    found = distortion([record_of(u + 0.01 * u**2, u + 0.01 * u**2)], band=(0.0, 0.45))
    assert "the force holds 0.0" in found.attrs["warnings"] and "one period" in found.attrs["warnings"]


def test_each_realisation_leaves_out_one_of_four_lines_of_its_own() -> None:
    draw = [np.flatnonzero(np.abs(np.fft.rfft(u)) > 1e-6) for u in cosets(6)]
    every = np.arange(1, SAMPLES // 4 + 1)
    every = every[np.isin(every % D, (1, D - 1))]
    groups = every[: every.size // 4 * 4].reshape(-1, 4)
    for lines in draw:
        assert np.isin(lines, every).all()
        assert (np.isin(groups, lines).sum(axis=1) == 3).all()
    assert set(np.concatenate(draw)) == set(every)
    assert len({tuple(lines) for lines in draw}) == 6


@pytest.mark.parametrize("modulus", [0, 6, 15])
def test_a_coset_needs_an_even_number_of_lines(modulus: int) -> None:
    with pytest.raises(MultisineError, match=f"coset of {modulus} lines .* even number of at least 8"):
        random_phase_multisine(
            SAMPLES, 1.0, (0.0, 0.2), rms=1.0, grid="coset", modulus=modulus, rng=np.random.default_rng(0)
        )
