"""What a record says of the work that its drive does on the rig."""

from __future__ import annotations

import pytest
import xarray as xr

import gearbench as gb
from gearbench.records.checks.look import Look
from gearbench.records.checks.passive import force_feeds_the_rig


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    case = gb.read_case("quick_lumped", ["experiment.realisations=1", "experiment.seed=5"])
    return gb.simulate(case).drop_vars(["dte", "force"])


def swinging_against(record: xr.Dataset, mean_sign: float) -> xr.Dataset:
    """The record with the swings of the driver's angle against the driven gear's turned round, and the mean times a
    sign."""
    one, two = (record.attrs[f"base_radius_{gear}"] for gear in ("driver", "driven"))
    rolled = one * record.angle_driver - two * record.angle_driven
    turned = mean_sign * rolled.mean() - (rolled - rolled.mean())
    return record.assign(angle_driver=((two * record.angle_driven + turned) / one).assign_attrs(units="rad"))


def test_a_mean_of_the_dte_that_lacks_a_motion_opposes_no_force(record: xr.Dataset) -> None:
    """Behind a soft coupling the angles swing against the drive; a gear moves unseen across its support, so that the
    mean of a dte of angles and y may have any sign. That of the angles has not."""
    turned = swinging_against(record, 1.0)
    unseen = turned.assign(y_driver=(turned.y_driver - 4e-5).assign_attrs(turned.y_driver.attrs))
    assert force_feeds_the_rig(Look(unseen)) == []
    (found,) = force_feeds_the_rig(Look(swinging_against(record, -1.0)))
    assert found.refused
