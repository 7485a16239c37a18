"""Channels and attributes in another unit throughout, which contradict nothing but Newton's second law."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from shared.spoilt import Change, attribute, bare, simulated, times, under_steady_load, with_values

from gearbench.records import RecordError
from gearbench.records.checks import check_record
from gearbench.records.checks.boundary import accelerations_as_torques
from gearbench.records.seen.look import GEARS, Look


@pytest.fixture(scope="module")
def rigs() -> dict[str, xr.Dataset]:
    return {name: simulated(name) for name in ("free", "tangential", "overdamped", "16/48", "16/48 noise")}


def in_units(factor: float, *names: str) -> Change:
    """Channels times a factor, and `torque_mean` as well, as of one who writes both in his own unit."""

    def change(record: xr.Dataset) -> xr.Dataset:
        for name in names:
            record = times(name, factor)(record)
        return attribute("torque_mean", factor)(record) if "torque_driver" in names else record

    return change


def test_torques_in_another_unit_throughout_are_refused(rigs: dict[str, xr.Dataset]) -> None:
    """The declared mean says the same, the accelerations of the gears do not."""
    # Where the driven gear is held, a rotor that is not in the driver's inertia looks the same.
    check_record(attribute("inertia_driver", 1 / 8.850746)(bare(rigs["tangential"])))
    steady = under_steady_load(bare(rigs["free"]).drop_vars(["y_driver", "y_driven"]))
    with pytest.raises(RecordError, match=r"the torques are 8\.8.. times what .* torques in lbf in"):
        check_record(in_units(8.850746, "torque_driver", "torque_driven")(steady))
    with pytest.raises(RecordError, match=r"0\.7376 times .* torques in lbf ft"):
        check_record(in_units(0.737562, "torque_driver", "torque_driven")(steady))
    said = check_record(in_units(1.5, "torque_driver", "torque_driven")(steady))
    (found,) = [one for one in said if "the torques are 1.5 times" in one.sentence]
    assert found.error == pytest.approx(1 / 3, rel=0.01)


def test_torques_in_another_unit_are_refused_where_the_load_repeats_the_drive(rigs: dict[str, xr.Dataset]) -> None:
    """Gears whose accelerations balance by themselves tell no unit; each against a centre's support does."""
    record = bare(rigs["16/48"])
    assert check_record(record) == ()
    for factor, words in ((0.737562, "lbf ft"), (8.850746, "lbf in")):
        with pytest.raises(RecordError, match=f"torques are {factor:.4g}.* torques in {words}"):
            check_record(in_units(factor, "torque_driver", "torque_driven")(record))


@pytest.mark.parametrize("noise", [1e-7, 3e-6, 1e-5])
def test_noise_of_angles_tells_no_unit(rigs: dict[str, xr.Dataset], noise: float) -> None:
    """Torques that balance by themselves, with a small part of accelerations that are noise."""
    record, random = bare(rigs["free"]).drop_vars(["y_driver", "y_driven"]), np.random.default_rng(3)
    for _ in range(16):
        noisy = record
        for gear in GEARS:
            values = record[f"angle_{gear}"].values
            noisy = with_values(noisy, f"angle_{gear}", values + noise * random.standard_normal(values.shape))
            values = record[f"torque_{gear}"].values
            noisy = with_values(noisy, f"torque_{gear}", values + 1e-3 * random.standard_normal(values.shape))
        assert accelerations_as_torques(Look(noisy)) == []


def test_a_sampling_rate_off_by_two_is_refused(rigs: dict[str, xr.Dataset]) -> None:
    """With a mesh period that was made from it, so that the angles agree."""
    record = bare(rigs["tangential"]).drop_vars("mesh_phase")
    wrong = attribute("mesh_period", 0.5)(attribute("sampling_rate", 2.0)(record))
    with pytest.raises(RecordError, match="a sampling_rate of twice the true one"):
        check_record(wrong)


def test_displacements_in_inches_are_said(rigs: dict[str, xr.Dataset]) -> None:
    found = check_record(in_units(1 / 0.0254, "y_driver", "y_driven")(bare(rigs["tangential"])))
    assert [one.sentence.split()[0] for one in found] == ["y_driver", "y_driven"]
    assert all("in inches" in one.sentence and one.error > 0.3 for one in found)


def test_base_radii_in_inches_are_refused(rigs: dict[str, xr.Dataset]) -> None:
    wrong = attribute("base_radius_driver", 1 / 0.0254)(attribute("base_radius_driven", 1 / 0.0254)(rigs["free"]))
    with pytest.raises(RecordError, match=r"inertia_driver = .* too small for base_radius_driver = 2.29"):
        check_record(bare(wrong))
