"""What other programs read: universal files by pyuff, MAT-files by SciPy; the spread of natural frequencies; orders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gearbench.cli import run_command_line
from gearbench.identification import FrfError, export_frf, htf, itf, make_frf, write_frf
from gearbench.identification.response.mode_spread import natural_frequency_deviation
from gearbench.identification.response.modes import itf_modes
from gearbench.identification.spectra.orders import order_spectrum
from gearbench.records.record import make_record

PHASES = 4


def response(step: float = 0.25) -> xr.Dataset:
    rng = np.random.default_rng(0)
    frequency = 100.0 + step * np.arange(50)

    def values(*shape: int) -> np.ndarray:
        return 1e-9 * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))

    modes = np.full((1, PHASES), 105.0), np.array([[0.02, 0.03, np.nan, 0.02]])
    return make_frf(
        "identified", frequency=frequency, itf=values(50, PHASES), htf=values(5, 50), modes=modes,
        itf_variance=np.full((50, PHASES), 1e-20), coherence=np.full(50, 0.9),
        attributes={
            "mesh_frequency": 8.0, "method": "lpm", "expected_error": 0.025,
            "warnings": f"dte holds the angles only\n{'x' * 100}\nanother",
        },
    )  # fmt: skip


# The format prints frequencies with six digits, once for equal steps and for each line else.
@pytest.mark.parametrize(("step", "digits"), [(0.25, 1e-9), (0.123456789, 5e-6)])
def test_a_universal_file_holds_each_phase_and_branch_with_units(tmp_path: Path, step: float, digits: float) -> None:
    import pyuff

    frf, path = response(step), tmp_path / "frf.uff"
    export_frf(frf, path)
    kinds = pyuff.UFF(str(path)).get_set_types()
    assert list(kinds) == [164] + [58] * (PHASES + 5)
    sets = pyuff.UFF(str(path)).read_sets()
    assert (sets[0]["length"], sets[0]["force"]) == (1.0, 1.0)
    wanted = [*itf(frf).values.T, *htf(frf).values]
    for one, values in zip(sets[1:], wanted, strict=True):
        assert np.abs(one["data"] - values).max() < 1e-10 * np.abs(values).max()
        assert one["x"] == pytest.approx(frf.frequency.values, rel=digits)
        assert (one["func_type"], one["ordinate_axis_units_lab"], one["orddenom_axis_units_lab"]) == (4, "m", "N")
        assert (one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]) == (8, 13)
        assert one["abscissa_axis_units_lab"] == "Hz"
    titles = [one["id1"] for one in sets[1:]]
    assert titles[1] == "ITF at mesh phase 0.25" and titles[PHASES] == "HTF of harmonic -2"
    assert [sets[1][f"id{line}"] for line in (3, 4, 5)] == [
        "expected error 2.50% of the ITF, by lpm", "dte holds the angles only", f"{'x' * 77}..."
    ]  # fmt: skip


def test_a_mat_file_holds_named_fields_and_their_units(tmp_path: Path) -> None:
    from scipy.io import loadmat

    frf, path = response(), tmp_path / "frf.mat"
    export_frf(frf, path)
    read = loadmat(path, simplify_cells=True)["frf"]
    assert path.read_bytes().startswith(b"MATLAB 5.0")
    assert np.array_equal(read["itf"], itf(frf).values) and np.array_equal(read["htf"], htf(frf).values)
    for name in ("frequency", "phase", "harmonic", "itf_var", "htf_var", "coherence"):
        assert np.array_equal(read[name], frf[name].values)
    assert np.isnan(read["damping_ratio"][2])
    assert read["units"] | {} == {
        "itf": "m/N", "htf": "m/N", "itf_var": "m^2/N^2", "htf_var": "m^2/N^2", "frequency": "Hz", "phase": "cycles",
        "harmonic": "1", "mode": "1", "natural_frequency": "Hz", "damping_ratio": "1", "coherence": "1",
    }  # fmt: skip
    assert read["attributes"]["mesh_frequency"] == 8.0 and read["attributes"]["kind"] == "identified"


def test_convert_writes_a_frequency_response_for_other_programs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_frf(response(), tmp_path / "frf.nc")
    for name in ("out.mat", "out.uff"):
        assert run_command_line(["convert", str(tmp_path / "frf.nc"), str(tmp_path / name)]) == 0
        assert "50 frequency, 4 phase" in capsys.readouterr().out
        assert (tmp_path / name).stat().st_size > 1000
    assert run_command_line(["convert", str(tmp_path / "frf.nc"), str(tmp_path / "out.txt")]) == 2
    assert "must end in .uff or .unv or .mat" in capsys.readouterr().err
    with pytest.raises(FrfError, match=r"out\.xls must end in"):
        export_frf(response(), tmp_path / "out.xls")


@pytest.mark.parametrize("together", [1, 5])
def test_the_spread_of_a_natural_frequency_is_that_of_repeated_draws(together: int) -> None:
    """One mode at 1100 Hz, 3 %; errors independent, or the same on five neighbouring lines."""
    frequency, noise = np.arange(800.0, 1400.0, 2.0), 0.01
    s, pole = 2j * np.pi * frequency, 2 * np.pi * 1100.0 * (-0.03 + 1j * np.sqrt(1 - 0.03**2))
    clean = 1.0 / ((s - pole) * (s - np.conj(pole)))
    clean /= np.abs(clean).max()
    rng = np.random.default_rng(2)
    draws = rng.standard_normal((2, frequency.size // together, 200)).repeat(together, axis=1)
    noisy = clean[:, None] + noise * np.sqrt(0.5) * (draws[0] + 1j * draws[1])
    variance = np.full(noisy.shape, noise**2)
    found = itf_modes(frequency, noisy, variance, modes=1)
    spread = natural_frequency_deviation(frequency, noisy, variance, found, together)
    empirical = np.nanstd(found[0][0])
    assert np.isfinite(found[0]).mean() > 0.95
    assert 0.8 < np.nanmedian(spread) / empirical < 1.6


def test_orders_of_a_swaying_speed_are_sharp() -> None:
    """A DTE of mesh orders 1 and 3 and of the driver's shaft while the speed sways by 20 %: no order leaks."""
    count, teeth, cycles = 16384, 16, 64
    time = np.arange(count) / count
    phase = cycles * (time + 0.2 / (2 * np.pi) * np.sin(2 * np.pi * time))
    turn = 2 * np.pi * phase
    dte = 3e-6 * np.cos(turn) + 1e-6 * np.sin(3 * turn) + 0.5e-6 * np.cos(turn / teeth)
    attributes = {"sampling_rate": float(count), "samples_per_period": count, "periods": 1, "teeth_driver": teeth}
    channels = {"dte": dte[None], "force": dte[None], "mesh_phase": phase[None]}
    orders = order_spectrum([make_record(channels, attributes)])
    found = {order: float(orders.sel(order=order, method="nearest")) for order in (1, 16, 48)}
    assert found == pytest.approx({1: 0.5e-6, 16: 3e-6, 48: 1e-6}, rel=1e-3)
    rest = orders.where(~orders["order"].round(6).isin([1, 16, 48]), 0.0)
    assert float(rest.max()) < 2e-9
