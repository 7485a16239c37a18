"""Doubtful records: refused with what they may cost, identified where the doubt is accepted or costs little."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from shared.spoilt import Change, bare, clip, constant, late, simulated, times, without

import gearbench as gb
from gearbench.cli import run_command_line
from gearbench.identification.doubts import COSTS, doubts_about
from gearbench.records import RecordError

PLAIN = gb.IdentificationSettings()
ACCEPTED = gb.IdentificationSettings(accept_doubts=True)


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    return simulated("free")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda r: clip("torque_driver", 0.5)(bare(r)), "torque_driver is clipped at"),
        (lambda r: late("torque_driver", 3)(bare(r)), "torque_driver lags behind .* samples"),
        (lambda r: constant("torque_driven")(bare(r)), "torque_driven is constant"),
        (lambda r: constant("y_driver")(bare(r)), "y_driver is constant"),
        (lambda r: times("dte", 1e3)(without("teeth_driver")(r[["dte", "force"]])), "dte in mm, or the force in kN"),
        (lambda r: times("force", 1e-3)(r[["dte", "force"]]), "dte in mm, or the force in kN"),
    ],
    ids=["clipped", "late", "dead torque", "dead y", "dte in mm", "force in kN"],
)
def test_a_costly_doubt_is_refused_with_field_cost_and_limit(record: xr.Dataset, change: Change, words: str) -> None:
    spoilt = change(record)
    cost_and_limit = r" may cost [0-9]+% of the response \(limit 10%\); --accept-doubts"
    with pytest.raises(RecordError, match=f"{words}.*{cost_and_limit}"):
        doubts_about([spoilt], PLAIN)
    sentences, cost = doubts_about([spoilt], ACCEPTED)
    assert sentences and cost > COSTS


def test_a_doubt_that_costs_little_is_a_warning(record: xr.Dataset) -> None:
    torque = record.torque_driver.values
    few = np.clip(torque, *np.quantile(torque, [0.002, 0.998]))
    (sentence,), cost = doubts_about([bare(record).assign(torque_driver=record.torque_driver.copy(data=few))], PLAIN)
    assert "torque_driver is clipped" in sentence and 0.0 < cost < COSTS


def test_a_sound_record_beside_a_doubtful_one_does_not_hide_it(record: xr.Dataset) -> None:
    other = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1", "experiment.seed=7"]))
    with pytest.raises(RecordError, match="record 2 of 2: torque_driver is clipped"):
        doubts_about([bare(other), clip("torque_driver", 0.5)(bare(record))], PLAIN)


def test_the_command_refuses_until_the_doubt_is_accepted(
    record: xr.Dataset, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    path, out = tmp_path / "late.nc", tmp_path / "frf.nc"
    gb.write_record(late("torque_driver", 3)(bare(record)), path)
    command = ["identify", str(path), "--out", str(out), "--harmonics", "4", "--order", "1", "--window", "20"]
    assert run_command_line(command) == 2
    assert "torque_driver lags behind" in capsys.readouterr().err and not out.exists()
    assert run_command_line([*command, "--accept-doubts"]) == 0
    assert "warning: torque_driver lags behind" in capsys.readouterr().out
    assert gb.read_frf(out).attrs["record_error"] > COSTS
