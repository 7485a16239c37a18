"""Comparisons of results that are known to differ by known amounts."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import BenchError
from gearbench.bench.results.compare import Results, align, best_shift, compare, load_results, write_csv


def frf(scale: float = 1.0, shift: float = 0.0, origin: str = "geometry") -> xr.Dataset:
    phase = np.arange(64) / 64
    frequency = np.arange(100.0, 1101.0, 10.0)
    curve = 1000 + 80 * np.cos(2 * np.pi * (phase - shift)) + 20 * np.sin(4 * np.pi * (phase - shift))
    itf = scale * np.outer(1e-9 * frequency, np.ones(64)) * (3 + 4j) / 5
    return xr.Dataset(
        {
            "itf_re": (("frequency", "phase"), itf.real),
            "itf_im": (("frequency", "phase"), itf.imag),
            "natural_frequency": (("mode", "phase"), scale * curve[None]),
        },
        coords={"frequency": frequency, "phase": phase},
        attrs={"schema": "gearbench-frf/1", "mesh_phase_origin": origin},
    )


def static(scale: float = 1.0) -> xr.Dataset:
    phase = np.arange(64) / 64
    te = scale * 1e-6 * (3 + 2 * np.cos(2 * np.pi * phase))[None]
    return xr.Dataset(
        {
            "transmission_error": (("load", "phase"), te),
            "stiffness_tangent": (("load", "phase"), scale * np.full((1, 64), 2e8)),
        },
        coords={"load": [1.0], "phase": phase},
        attrs={"schema": "gearbench-static/1"},
    )


def test_rows_carry_difference_and_percent() -> None:
    rows = compare(Results("a", static=static(), frf=frf()), Results("b", static=static(1.1), frf=frf(0.5)))
    found = {(row.quantity, row.phase_or_band): row for row in rows}
    ptp = found["static TE, peak to peak", "mesh period"]
    assert (ptp.unit, ptp.a, ptp.b) == ("um", pytest.approx(4.0), pytest.approx(4.4))
    assert (ptp.difference, ptp.percent) == (pytest.approx(0.4), pytest.approx(10.0))
    order = found["static TE, amplitude", "mesh order 1"]
    assert (order.a, order.b) == (pytest.approx(2.0), pytest.approx(2.2))
    stiffness = found["mesh stiffness, tangent", "0.5 cycles"]
    assert (stiffness.a, stiffness.b) == (pytest.approx(200.0), pytest.approx(220.0))
    lowest = found["first mode, lowest", "mesh period"]
    assert lowest.percent == pytest.approx(-50.0)
    band = found["ITF, rms over phase and band", "100-200 Hz"]
    assert band.unit == "nm/N"
    assert band.a == pytest.approx(np.sqrt(np.mean(np.arange(100.0, 201.0, 10.0) ** 2)))
    assert band.b == pytest.approx(band.a / 2)


@pytest.mark.parametrize("shift", [0.3, -0.2, 0.5])
def test_an_arbitrary_phase_is_estimated_and_said(shift: float) -> None:
    one, two = Results("a", frf=frf()), Results("b", frf=frf(shift=shift, origin="arbitrary"))
    aligned, sentence = align(one, two)
    assert (aligned.shift + shift + 0.5) % 1.0 - 0.5 == pytest.approx(0.0, abs=1 / 256)
    assert "arbitrary" in sentence and "shifted" in sentence
    apart = [abs(row.percent) for row in compare(one, two) if row.quantity == "first natural frequency"]
    together = [
        abs(row.percent) for row in compare(one, aligned) if row.quantity == "first natural frequency"
    ]
    assert max(together) < 0.3 < max(apart)


def test_known_phases_are_left_alone() -> None:
    one, two = Results("a", frf=frf()), Results("b", frf=frf(shift=0.25))
    assert align(one, two) == (two, "")


def test_best_shift_moves_the_second_onto_the_first() -> None:
    phase = np.arange(200) / 200
    one, two = np.exp(np.cos(2 * np.pi * (phase - 0.4))), np.exp(np.cos(2 * np.pi * (phase - 0.3)))
    assert best_shift(one, two) == pytest.approx(0.1)


def test_results_are_found_by_folder_and_by_schema(tmp_path: Path) -> None:
    frf().to_netcdf(tmp_path / "frf.nc", engine="h5netcdf")
    static().to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    folder = load_results(tmp_path)
    assert folder.frf is not None and folder.static is None
    assert load_results(tmp_path / "other.nc").static is not None
    (tmp_path / "broken.nc").write_bytes(b"no")
    xr.Dataset().to_netcdf(tmp_path / "empty.nc", engine="h5netcdf")
    for name, words in (
        ("broken.nc", "truncated"),
        ("empty.nc", "schema none"),
        ("none.nc", "does not exist"),
    ):
        with pytest.raises(BenchError, match=words):
            load_results(tmp_path / name)
    with pytest.raises(BenchError, match="nothing"):
        compare(folder, load_results(tmp_path / "other.nc"))


def test_csv_holds_the_rows(tmp_path: Path) -> None:
    rows = compare(Results("a", static=static()), Results("b", static=static(1.1)))
    write_csv(rows, tmp_path / "compare.csv")
    with (tmp_path / "compare.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert list(lines[0]) == ["quantity", "phase_or_band", "unit", "a", "b", "difference", "percent"]
    assert float(lines[0]["percent"]) == pytest.approx(10.0)
    assert len(lines) == len(rows)
