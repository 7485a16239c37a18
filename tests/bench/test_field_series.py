"""Fields at instants of a transient: those of statics where it turns slowly, zero where teeth are apart, and a series
that others read."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import meshio
import numpy as np
import pytest
from shared.twins import supports, twin_case

from gearbench.bench import BenchError, simulate
from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.stress.fields import field_dte, fields_at, pair_fields, stress_gears
from gearbench.bench.stress.series import check_series, record_fields, stand_of, write_series
from gearbench.rig import Case


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    return twin_case(tmp_path_factory.mktemp("case"), *supports("1e11", "1e5"), "simulation.outputs=teeth")


@pytest.mark.validation
def test_slow_fields_are_those_of_statics(case: Case, tmp_path: Path) -> None:
    """In single contact and where two pairs carry; without friction, so that the load is all normal."""
    record, times = simulate(case), [0.01, 0.15]
    elastic = elastic_rig(case.rig, case.simulation)
    gears = stress_gears(elastic, case.simulation.element_size)
    found = list(record_fields(case, record, times))
    for moment, time in zip(found, times, strict=True):
        fields = moment.fields
        assert moment.time == pytest.approx(record["time"].values[0] + time, abs=0.5 / 2048)
        phase = float(record["mesh_phase"].values[0, round(2048 * time)])
        assert fields.phase == pytest.approx(phase, abs=1e-9)
        rest = pair_fields(elastic, gears, phase, field_dte(elastic, phase, 50.0, "N m"))
        assert fields.torque == pytest.approx(50.0, rel=2e-3) and len(fields.contacts) == len(rest.contacts)
        # The peak is that of the nodes, which lie a little differently about a contact that has moved a little.
        assert fields.von_mises.max() == pytest.approx(rest.von_mises.max(), rel=1e-2)
        one, two = (np.hypot(*part.displacement.T) for part in (fields, rest))
        assert one.max() == pytest.approx(two.max(), rel=5e-3)
        # Away from the contacts both have the same nodes: those of the mesh that all sectors share.
        common = [i for i, p in enumerate(fields.mesh.points[:4000]) if i % 40 == 0 and _same(p, rest.mesh.points[i])]
        assert len(common) > 20
        assert one[common] == pytest.approx(two[common], abs=5e-3 * two.max())
        assert fields.stress[common] == pytest.approx(rest.stress[common], abs=5e-3 * np.abs(rest.stress[common]).max())
    series, *files = write_series(iter(found), tmp_path, "record")
    entries = ElementTree.parse(series).getroot().findall("Collection/DataSet")
    assert [float(entry.attrib["timestep"]) for entry in entries] == [moment.time for moment in found]
    for entry, path, moment in zip(entries, files, found, strict=True):
        read = meshio.read(tmp_path / entry.attrib["file"])
        assert path.name == entry.attrib["file"]
        assert read.point_data["von_mises"] == pytest.approx(moment.fields.von_mises, rel=1e-6)
        assert read.point_data["displacement"][:, :2] == pytest.approx(moment.fields.displacement, rel=1e-6, abs=1e-15)
    _paraview_reads(series, [moment.time for moment in found])


def _same(one: np.ndarray, two: np.ndarray) -> bool:
    return bool(np.hypot(*(one - two)) < 1e-6)


def _paraview_reads(series: Path, times: list[float]) -> None:
    pyvista = pytest.importorskip("pyvista")
    reader = pyvista.get_reader(str(series))
    assert reader.time_values == pytest.approx(times)
    reader.set_active_time_point(1)
    (block,) = reader.read()
    assert block.n_points and "stress" in block.point_data


def test_teeth_apart_carry_nothing(case: Case) -> None:
    record = simulate(case).isel(time=slice(0, 4)).copy(deep=True)
    elastic = elastic_rig(case.rig, case.simulation)
    for name in ("leaving", "middle", "entering"):
        record[f"tooth_force_{name}"][:] = 0.0
    stand = stand_of(elastic, record, 2)
    assert not stand.pairs
    fields = fields_at(elastic, stress_gears(elastic, case.simulation.element_size), stand)
    assert len(fields.mesh.points) and not fields.von_mises.any() and not fields.contacts


@pytest.mark.parametrize(
    ("model", "times", "words"),
    [("lumped", [0.0], "lacks"), (None, [0.3], "lie outside"), (None, [-0.1], "lie outside")],
)
def test_what_has_no_fields_is_refused(case: Case, model: str | None, times: list[float], words: str) -> None:
    with pytest.raises(BenchError, match=words):
        check_series(case, times, model)


def test_a_record_without_tooth_forces_is_refused(case: Case) -> None:
    plain = simulate(case).drop_vars("tooth_force_middle")
    with pytest.raises(BenchError, match="no tooth forces"):
        list(record_fields(case, plain, [0.0]))
