"""The dataset of a frequency response: contents, round trip, refusals."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from shared.reference_rig import ReferenceRig

from gearbench.identification.response.exact import exact_frf, frozen_frf
from gearbench.identification.response.frf import FrfError, htf, itf, make_frf, read_frf, validate_frf, write_frf
from gearbench.identification.truth.periodic import PeriodicSystemError, itf_from_htf


def sample(**attributes: object) -> xr.Dataset:
    rng = np.random.default_rng(0)
    branches = rng.standard_normal((5, 4)) + 1j * rng.standard_normal((5, 4))
    modes = np.array([[1.0, np.nan] * 4]), np.full((1, 8), 0.1)
    return make_frf(
        "identified",
        frequency=np.array([1.0, 2.0, 3.0, 4.0]),
        itf=itf_from_htf(branches, 8),
        htf=branches,
        modes=modes,
        attributes=attributes,
    )


def test_round_trip_through_a_file(tmp_path: Path) -> None:
    frf = sample(method="lpm", unknowns=12, warnings="first\nsecond", nothing=None)
    assert "nothing" not in frf.attrs
    write_frf(frf, tmp_path / "frf.nc")
    again = read_frf(tmp_path / "frf.nc")
    xr.testing.assert_identical(frf, again)
    assert [path.name for path in tmp_path.iterdir()] == ["frf.nc"]
    with h5py.File(tmp_path / "frf.nc") as file:  # what MATLAB sees
        assert file["itf_re"].shape == (4, 8)
        assert file["harmonic"][:].tolist() == [-2, -1, 0, 1, 2]
        assert file["phase"][1] == 0.125


def test_complex_views() -> None:
    frf = sample()
    phase = np.exp(2j * np.pi * np.outer(frf.harmonic, frf.phase))
    assert itf(frf).values == pytest.approx(htf(frf).values.T @ phase, abs=1e-12)


def test_what_is_no_frf_is_named(tmp_path: Path) -> None:
    frf = sample()
    for broken, words in [
        (frf.assign_attrs(schema="gearbench-record/1"), "gearbench-record/1"),
        (frf.assign_attrs(kind="guessed"), "'guessed'.*identified, exact, frozen"),
        (frf.drop_vars("itf_var"), "itf_var is missing"),
        (frf.assign(itf_re=frf.itf_re * np.nan), "itf_re holds values that are not finite"),
        (frf.assign(htf_var=frf.htf_var - 1), "htf_var holds negative"),
        (frf.isel(frequency=slice(None, None, -1)), "frequency does not rise"),
        (frf.assign(itf_im=frf.itf_im.T), "itf_im has dimensions"),
    ]:
        with pytest.raises(FrfError, match=words):
            validate_frf(broken)
    with pytest.raises(FrfError, match="does not exist"):
        read_frf(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("no NetCDF")
    with pytest.raises(FrfError, match="truncated or no NetCDF-4"):
        read_frf(tmp_path / "text.nc")
    with pytest.raises(FrfError, match="itf_var has shape"):
        make_frf(
            "exact",
            frequency=np.arange(3.0),
            itf=np.ones((3, 4), complex),
            htf=np.ones((1, 3), complex),
            modes=(np.empty((0, 4)), np.empty((0, 4))),
            itf_variance=np.ones((3, 3)),
        )


def test_exact_and_frozen_datasets_of_the_reference_rig() -> None:
    system = ReferenceRig(mesh_frequency=50.0).system(512)
    frequency = np.arange(800.0, 1500.0, 10.0)
    exact = exact_frf(system, frequency, phases=64, harmonics=12)
    frozen = frozen_frf(system, frequency, phases=64, harmonics=12)
    assert (exact.kind, frozen.kind) == ("exact", "frozen")
    # The branches of the exact response add up to its ITF, to within the truncation that it states.
    rebuilt = itf_from_htf(htf(exact).values, 64)
    error = np.linalg.norm(rebuilt - itf(exact).values) / np.linalg.norm(itf(exact).values)
    assert error == pytest.approx(exact.attrs["truncation_error"], rel=0.05)
    assert frozen.natural_frequency.values[0].min() == pytest.approx(1013, abs=1.5)
    # Branches do not alias, however few phases are wanted.
    few = exact_frf(system, frequency, phases=8, harmonics=12)
    assert np.abs(htf(few).values - htf(exact).values).max() < 1e-6 * np.abs(htf(exact).values).max()
    assert few.attrs["truncation_error"] == pytest.approx(exact.attrs["truncation_error"], rel=1e-6)
    with pytest.raises(PeriodicSystemError, match=r"phases = 16.*harmonics = 12"):
        frozen_frf(system, frequency, phases=16, harmonics=12)
