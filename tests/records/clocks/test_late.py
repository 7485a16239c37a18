"""A delay that turns a force over where a resonance is most of it: one that another account denies."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearbench.records.clocks import late as module
from gearbench.records.clocks.delays import Delays

OMEGA = 2 * np.pi * np.arange(20.0, 400.0, 2.0)
RELATIONS = {
    ("driver", "driven"): frozenset({"torque_driver", "torque_driven"}),
    ("driver", "y_driver"): frozenset({"torque_driver", "y_driver"}),
    ("driven", "y_driven"): frozenset({"torque_driven", "y_driven"}),
}


def accounts_of(**lines: np.ndarray) -> Any:
    """Accounts of the mesh force by both gears' torques, and by displacements times a stiffness that fits best."""

    def misfit(relation: tuple[str, str], names: frozenset[str] = frozenset(), turn: Any = None) -> np.ndarray:
        turn = np.ones((1, OMEGA.size)) if turn is None else turn
        force, other = (
            lines[name] * (turn if name in names else np.ones_like(turn))
            for name in sorted(RELATIONS[relation], key=lambda name: (name[0] == "y", name == "torque_driven"))
        )
        if relation == ("driver", "driven"):
            rest, size = force - other, 0.5 * (np.linalg.norm(force, axis=1) + np.linalg.norm(other, axis=1))
        else:
            stiffness = (force * other.conj()).real.sum(axis=1) / (np.abs(other) ** 2).sum(axis=1)
            rest, size = force - stiffness[:, None] * other, np.linalg.norm(force, axis=1)
        return np.asarray(np.linalg.norm(rest, axis=1) / size)

    return SimpleNamespace(omega=OMEGA, relations=lambda: list(RELATIONS), channels=RELATIONS.get, misfit=misfit)


def found(accounts: Any) -> module.Lag | None:
    return module._late_channel(Delays(accounts, np.arange(-200, 201) * 5e-5))


@pytest.fixture
def force() -> np.ndarray:
    """A force with a resonance at 100 Hz."""
    return np.asarray(1.0 / (1.0 - (OMEGA / (200.0 * np.pi)) ** 2 + 0.06j * OMEGA / (200.0 * np.pi)))


def test_half_a_period_of_a_resonance_is_no_delay(force: np.ndarray) -> None:
    """A rotor between the torque and its gear turns one account over; a delay of 5 ms nearly does so to the other, and
    spoils what that gear's centre says."""
    rough = force + 0.35 * np.random.default_rng(1).standard_normal(OMEGA.size) * np.abs(force)
    assert found(accounts_of(torque_driver=-force, y_driver=-rough, torque_driven=force, y_driven=force)) is None


def test_a_delay_that_all_accounts_show_is_one(force: np.ndarray) -> None:
    late = force * np.exp(-0.003j * OMEGA)
    lag = found(accounts_of(torque_driver=force, y_driver=force, torque_driven=late, y_driven=force))
    assert lag is not None and lag.channels == {"torque_driven"} and lag.delay == pytest.approx(0.003, abs=1e-6)
