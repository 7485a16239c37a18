"""Comparisons as a whole: what may be given, and what is said with the rows."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr

from gearbench.bench import BenchError, compare, simulate, static
from gearbench.cases import read_case
from gearbench.records import write_record

SHORT = ["experiment.realisations=1", "experiment.samples_per_period=4096"]


@pytest.fixture(scope="module")
def records() -> tuple[xr.Dataset, xr.Dataset]:
    one, two = (simulate(read_case("quick_lumped", [*SHORT, f"experiment.torque_mean_nm={nm}"])) for nm in (200, 300))
    return one, two


def test_records_at_other_conditions_are_not_taken_for_other_models(records: tuple[xr.Dataset, xr.Dataset]) -> None:
    found = compare(*records)
    assert found.notes == ("mean torque differs: 200 and 300 N m",)
    assert {row.quantity for row in found.rows} == {"DTE, mean over mesh periods"}
    assert compare(records[0], records[0]).notes == ()


def test_a_file_and_a_dataset_are_the_same(records: tuple[xr.Dataset, xr.Dataset], tmp_path: Path) -> None:
    write_record(records[1], tmp_path / "two.nc")
    by_file, by_value = compare(records[0], tmp_path / "two.nc"), compare(*records)
    assert (by_file.b.name, by_value.b.name) == ("two", "b")
    assert by_file.rows == by_value.rows


def test_an_arbitrary_origin_is_shifted_and_said(records: tuple[xr.Dataset, xr.Dataset]) -> None:
    found = compare(records[0], records[0].assign_attrs(mesh_phase_origin="arbitrary"))
    assert len(found.notes) == 1 and "b is shifted by +0.0000 cycles" in found.notes[0]


def test_totals_leave_single_phases_out() -> None:
    case = read_case("quick_lumped")
    found = compare(static(case, torque=[100.0]), static(case, torque=[200.0]))
    assert {row.quantity for row in found.totals} == {"static TE, peak to peak", "static TE, amplitude"}
    assert len(found.rows) > len(found.totals)


def test_what_is_no_result_is_refused(records: tuple[xr.Dataset, xr.Dataset]) -> None:
    with pytest.raises(BenchError, match="b has schema none, which is not one of gearbench-record/1"):
        compare(records[0], xr.Dataset())
    with pytest.raises(BenchError, match="hold nothing that both"):
        compare(records[0], static(read_case("quick_lumped")))
