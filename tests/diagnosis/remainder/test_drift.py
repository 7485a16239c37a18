"""A stiffness that drifts over a record, read off repetitions that are made by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.diagnosis.forces.unknowns import group, unknowns_of
from gearbench.diagnosis.remainder import drift as module
from gearbench.diagnosis.remainder.drift import Drift, drift_of
from gearbench.rig.contract import Place

SAMPLES, REPETITIONS, NOISE = 4096, 4, 1e-3
BINS = np.arange(1, 900)
SHOWN = np.flatnonzero(BINS % 9 == 0)  # of the lines, those that a stiffness moves
UNKNOWNS = unknowns_of(
    [
        group("stiffness", "1", ("driver", "driven"), 0.1, slot="stiffness"),
        group("scale", "1", ("mesh",), 0.06, slot="scale"),
    ],
    2,
)
DRIVER, DRIVEN, MESH = range(3)


def derivatives() -> np.ndarray:
    """(3, lines) of two channels in a row."""
    rng = np.random.default_rng(5)
    lines = np.zeros((3, 2, BINS.size), dtype=complex)
    lines[..., SHOWN] = rng.standard_normal((3, 2, SHOWN.size)) + 1j * rng.standard_normal((3, 2, SHOWN.size))
    return lines.reshape(3, -1)


def found(
    changes: np.ndarray,
    monkeypatch: pytest.MonkeyPatch,
    columns: np.ndarray | None = None,
    place: Place | None = None,
    *,
    told: bool = False,
    torque: np.ndarray | None = None,
    steady: bool = True,
) -> Drift | None:
    """`changes` (repetitions, lines of two channels): what each repetition has beside the others and noise; `columns`
    (3, lines): what the rig is said to do, if not what it does; `torque` (repetitions, samples) on the driver."""
    rng, channels = np.random.default_rng(7), {}
    for number, name in enumerate(("dte", "y_driver")):
        spectrum = np.zeros((REPETITIONS, SAMPLES // 2 + 1), dtype=complex)
        spectrum[:, BINS] = 3.0 + changes[:, number * BINS.size : (number + 1) * BINS.size]
        noise = NOISE * (rng.standard_normal(spectrum.shape) + 1j * rng.standard_normal(spectrum.shape))
        channels[name] = np.fft.irfft((spectrum + noise) * SAMPLES, SAMPLES)
    monkeypatch.setattr(module, "measured_channels", lambda one: channels)
    driven = np.zeros((REPETITIONS, SAMPLES)) if torque is None else torque
    measured: Any = SimpleNamespace(name="one", repetitions=REPETITIONS, periods={"torque_driver": driven})
    plan = ((0, "dte", BINS), (0, "y_driver", BINS))
    target = SimpleNamespace(plan=plan, measurements=(measured,), gains=np.ones(2 * len(BINS)))
    optimum = SimpleNamespace(sensitivity=SimpleNamespace(jacobian=derivatives() if columns is None else columns))
    simulated: Any = SimpleNamespace(
        simulator=SimpleNamespace(nudges={}, target=target, smooth=(0,)),
        selection=SimpleNamespace(best=optimum),
        layout=SimpleNamespace(unknowns=UNKNOWNS),
    )
    return drift_of(simulated, [measured] if steady else [], place, told=told)


def drifting(row: int, by: float) -> np.ndarray:
    """What repetitions have whose stiffness has changed by so much of itself from the first sample to the last."""
    passed = (np.arange(REPETITIONS) + 0.5) / REPETITIONS
    return np.log1p(by * passed)[:, None] * derivatives()[row]


@pytest.mark.parametrize(
    ("row", "by", "place"),
    [(DRIVER, -0.07, "driver-support"), (DRIVEN, 0.03, "driven-support"), (MESH, 0.05, "mesh")],
)
def test_a_drift_is_found_with_its_place_and_size(
    row: int, by: float, place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = found(drifting(row, by), monkeypatch)
    assert one is not None and one.place == place
    assert one.value == pytest.approx(by, abs=max(4 * one.std, 1e-4)) and one.std < 0.05 * abs(by)
    assert one.share > 0.95 and one.nats > 30.0


def test_noise_alone_and_what_comes_and_goes_are_no_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    assert found(drifting(MESH, 0.0), monkeypatch) is None
    turns = np.exp(2j * np.pi * np.random.default_rng(2).random((REPETITIONS, 1)))
    assert found(0.02 * turns * derivatives()[DRIVER], monkeypatch) is None
    # Up and down again: what a drift would make of it is less than half.
    assert found(0.05 * np.array([[1.0], [-1.0], [1.0], [-1.0]]) * derivatives()[MESH], monkeypatch) is None


def test_a_place_that_another_explains_nearly_as_well_is_not_told(monkeypatch: pytest.MonkeyPatch) -> None:
    alike = derivatives()
    alike[MESH] = alike[DRIVER] + 0.05 * alike[MESH]
    changes = drifting(DRIVER, -0.07) + drifting(DRIVEN, 0.03)
    assert found(changes, monkeypatch) is not None and found(changes, monkeypatch, alike) is None


def test_the_place_of_most_force_is_that_of_the_drift_where_it_explains_nearly_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The rig's derivative by the stiffness that drifts is off by more than that by another."""
    off = derivatives()
    off[DRIVER], off[MESH] = off[DRIVER] + 0.15 * off[DRIVEN], off[DRIVER] + 0.05 * off[MESH]
    changes = drifting(DRIVER, -0.07)
    told = {place: found(changes, monkeypatch, off, place) for place in (None, "driver-support", "driven-support")}
    assert all(one is not None for one in told.values())
    assert [one.place for one in told.values() if one] == ["mesh", "driver-support", "mesh"]
    there = told["driver-support"]
    assert there is not None and there.value == pytest.approx(-0.07, rel=0.05)


def test_no_drift_is_told_at_another_place_than_the_rig_found_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = drifting(DRIVER, -0.07)
    at_drive, there = (found(changes, monkeypatch, None, place, told=True) for place in ("drive", "driver-support"))
    assert at_drive is None and there is not None and there.place == "driver-support"


@pytest.mark.parametrize("aligned", [True, False])
def test_a_rig_that_is_off_at_a_resonance_tells_a_drift_where_every_channel_is_closer(
    aligned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Most of what its derivatives have is in lines where nothing changes, and the other way round; at a place that is
    told alone, with an interval that holds the size."""
    moved = derivatives()[DRIVER].reshape(2, -1)
    said = 1.4 * moved
    moved[:, SHOWN[::3]], said[:, SHOWN[2::24]] = 0.0, 0.0
    if aligned:
        said[:, SHOWN[1::3]] = 0.0
    else:
        said[1] *= -0.1  # a little further off in one channel, far closer in the other
    columns = derivatives()
    columns[DRIVER] = said.reshape(-1)
    passed = (np.arange(REPETITIONS) + 0.5) / REPETITIONS
    changes = np.log1p(-0.07 * passed)[:, None] * moved.reshape(-1)
    assert found(changes, monkeypatch, columns, "driver-support") is None
    one = found(changes, monkeypatch, columns, "driver-support", told=True)
    assert (one is not None) is aligned
    # A damper that changes looks like a drift of a percent there.
    assert found(0.15 * changes, monkeypatch, columns, "driver-support", told=True) is None
    if one is not None:
        assert one.share < 0.5 and one.everywhere and abs(one.value + 0.07) < 1.6449 * one.std < 0.07


def test_what_a_stiffness_hardly_moves_is_no_drift_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else its logarithm would be of hundreds."""
    for sign in (-1.0, 1.0):
        assert found(sign * drifting(DRIVER, 0.07), monkeypatch, 1e-6 * derivatives()) is None


def test_records_that_need_not_repeat_have_none(monkeypatch: pytest.MonkeyPatch) -> None:
    assert found(drifting(DRIVER, -0.07), monkeypatch, steady=False) is None


def test_lines_whose_torque_changes_tell_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A drive that grows over the record moves everything as a rig that softens would."""
    rng = np.random.default_rng(4)
    lines = 1e-4 * (rng.standard_normal((REPETITIONS, SAMPLES // 2 + 1)) + 0j)
    same = np.fft.irfft(lines * SAMPLES, SAMPLES)
    lines[:, BINS[SHOWN]] += np.arange(REPETITIONS)[:, None]
    changing = np.fft.irfft(lines * SAMPLES, SAMPLES)
    told = [found(drifting(DRIVER, -0.07), monkeypatch, torque=torque) for torque in (same, changing)]
    assert told[0] is not None and told[1] is None
    # Rounding is larger where the torque is, of one that has no noise.
    rounded = np.tile(changing[-1:], (REPETITIONS, 1)) * (1.0 + 1e-9 * np.arange(REPETITIONS)[:, None])
    assert found(drifting(DRIVER, -0.07), monkeypatch, torque=rounded) is not None


def test_one_channel_alone_does_not_make_a_drift_certain(monkeypatch: pytest.MonkeyPatch) -> None:
    """There is no other to scatter from; what its lines leave says how well it is known."""
    alone, other = drifting(DRIVER, -0.07), drifting(DRIVEN, -0.07)
    alone[:, BINS.size :] = 0.0
    mixed = alone + 0.7 * other * (alone != 0.0)
    one = found(mixed, monkeypatch)
    assert one is not None and one.std > 0.01 * abs(one.value)
