"""What a record says of the work that its drive does on the rig."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import gearbench as gb
from gearbench.records.checks import passive
from gearbench.records.checks.passive import force_feeds_the_rig
from gearbench.records.seen.look import Look


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


def test_a_late_angle_turns_the_highest_lines_first_and_a_sign_all(
    record: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The balance of forces shows no delay where little of the force accelerates the gear."""
    monkeypatch.setattr(passive, "clocks_agree", lambda look: [])
    monkeypatch.setattr(passive, "accounts_agree", lambda look: True)
    one, two = (record.attrs[f"base_radius_{gear}"] for gear in ("driver", "driven"))
    look, count = Look(record), record.sizes["time"]
    assert look.force is not None
    omega = 2 * np.pi * np.fft.rfftfreq(count, 1 / record.sampling_rate)
    top = look.omega[look.excited(look.force)][-1]
    yielding = np.zeros(omega.size, dtype=complex)
    yielding[1:] = np.fft.rfft(look.force)[1:] / (1j * omega[1:])

    def late(delay: float, sign: float) -> xr.Dataset:
        """The record of a rig that is a damper, whose driver's angle is late by a part of the shortest period."""
        turned = np.fft.irfft(sign * yielding * np.exp(-2j * np.pi * delay * omega / top), count)
        rolled = 1e-5 + 1e-6 * turned / turned.std()
        return record.assign(angle_driver=((two * record.angle_driven + rolled) / one).assign_attrs(units="rad"))

    assert force_feeds_the_rig(Look(late(0.0, 1.0))) == []
    (found,) = force_feeds_the_rig(Look(late(0.6, 1.0)))
    assert not found.refused
    assert "shifted in time" in found.sentence
    (found,) = force_feeds_the_rig(Look(late(0.0, -1.0)))
    assert found.refused


def test_a_late_angle_opposes_in_the_mean_too(record: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the rate is a quarter of a period behind the torque, as of a gear that only its inertia holds, a late angle
    opposes the torque on all lines; by its speed it falls behind the driven gear too. Else the mean tells a sign."""
    monkeypatch.setattr(passive, "clocks_agree", lambda look: [])
    one, two = (record.attrs[f"base_radius_{gear}"] for gear in ("driver", "driven"))
    look, count = Look(record), record.sizes["time"]
    assert look.force is not None
    omega = 2 * np.pi * np.fft.rfftfreq(count, 1 / record.sampling_rate)
    delay = 0.3 * 2 * np.pi / look.omega[look.excited(look.force)][-1]
    rolling = np.zeros(omega.size, dtype=complex)
    rolling[1:] = -np.fft.rfft(look.force)[1:] / omega[1:] * np.exp(-1j * omega[1:] * delay)
    swing = np.fft.irfft(rolling, count)

    def with_mean(mean: float) -> Look:
        rolled = mean + 1e-6 * swing / swing.std()
        return Look(
            record.assign(angle_driver=((two * record.angle_driven + rolled) / one).assign_attrs(units="rad"))
        )

    behind = -one * look.speed("driver") * delay
    (found,) = force_feeds_the_rig(with_mean(behind + 2e-6))
    assert not found.refused
    assert "late by" in found.sentence
    (found,) = force_feeds_the_rig(with_mean(3.0 * behind))
    assert found.refused
