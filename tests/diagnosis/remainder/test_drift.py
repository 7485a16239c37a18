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
    by_forces: Place | None = None,
) -> Drift | None:
    """`changes` (repetitions, lines of two channels): what each repetition has beside the others and noise; `columns`
    (3, lines): what the rig is said to do, if not what it does."""
    rng, channels = np.random.default_rng(7), {}
    for number, name in enumerate(("dte", "y_driver")):
        spectrum = np.zeros((REPETITIONS, SAMPLES // 2 + 1), dtype=complex)
        spectrum[:, BINS] = 3.0 + changes[:, number * BINS.size : (number + 1) * BINS.size]
        noise = NOISE * (rng.standard_normal(spectrum.shape) + 1j * rng.standard_normal(spectrum.shape))
        channels[name] = np.fft.irfft((spectrum + noise) * SAMPLES, SAMPLES)
    monkeypatch.setattr(module, "measured_channels", lambda one: channels)
    target = SimpleNamespace(plan=((0, "dte", BINS), (0, "y_driver", BINS)), measurements=(None,))
    optimum = SimpleNamespace(sensitivity=SimpleNamespace(jacobian=derivatives() if columns is None else columns))
    simulated: Any = SimpleNamespace(
        simulator=SimpleNamespace(nudges={}, target=target, smooth=(0,)),
        selection=SimpleNamespace(best=optimum),
        layout=SimpleNamespace(unknowns=UNKNOWNS),
    )
    return drift_of(simulated, by_forces)


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
