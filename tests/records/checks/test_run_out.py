"""What turns with a shaft is named, and nothing else is taken for it."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.records.checks.run_out import shafts_turn_true
from gearbench.records.record import make_record
from gearbench.records.seen.look import Look

RATE, SAMPLES, RADII = 4096.0, 8192, {"driver": 0.02, "driven": 0.05}
SIZE = 2e-6  # m rms of what the excitation makes


def look(turns: float, **errors: tuple[float, float]) -> Look:
    """Gears of 20 and 50 teeth that swing at a hundred frequencies; `errors`: gear -> order of its turn and size [m] on
    the base circle by which its angle errs."""
    random, time = np.random.default_rng(4), np.arange(SAMPLES) / RATE
    lines = random.choice(np.arange(5, 1000), 100, replace=False) / (SAMPLES / RATE)
    swing = np.sin(2 * np.pi * np.outer(time, lines) + random.uniform(0, 6.28, 100)).sum(axis=1) * SIZE / np.sqrt(50)
    channels = {name: 100.0 + 0.0 * time for name in ("torque_driver", "torque_driven")}
    for gear, radius in RADII.items():
        turned = 2 * np.pi * turns * RADII["driver"] / radius * time / time[-1]
        order, size = errors.get(gear, (1.0, 0.0))
        turned += (swing if gear == "driver" else 0.0) / radius
        channels[f"angle_{gear}"] = turned + size / radius * np.sin(order * turned + 0.3)
    about = {f"base_radius_{gear}": radius for gear, radius in RADII.items()}
    about |= {"teeth_driver": 20, "teeth_driven": 50, "sampling_rate": RATE, "samples_per_period": SAMPLES}
    about |= {"periods": 1, "driven_boundary": "speed", "mesh_period": SAMPLES / RATE / turns / 20}
    about |= {"settling_residual": 0.0}
    return Look(make_record({name: values[None] for name, values in channels.items()}, about))


@pytest.mark.parametrize(("gear", "order"), [("driver", 1), ("driver", 2), ("driven", 1), ("driven", 2)])
@pytest.mark.parametrize("size", [0.2, 1.0, 10.0])
def test_run_out_is_named_with_its_size(gear: str, order: int, size: float) -> None:
    """From a fiftieth of the dte's power on where it leaks into all lines, else from a twentieth."""
    for turns in (5.0, 6.3):
        if size < 0.3 and turns == 5.0:
            assert shafts_turn_true(look(turns, **{gear: (order, size * SIZE)})) == []
            continue
        (found,) = shafts_turn_true(look(turns, **{gear: (order, size * SIZE)}))
        assert not found.refused and found.error == 0.0
        assert f"at order {order} of the {gear}'s shaft" in found.sentence
        told = float(found.sentence.split("holds ")[1].split(" um")[0])
        assert told == pytest.approx(1e6 * size * SIZE, rel=0.1)


@pytest.mark.parametrize("turns", [1.0, 2.7, 6.3])
def test_what_is_no_low_order_is_no_run_out(turns: float) -> None:
    assert shafts_turn_true(look(turns)) == []
    for order in (0.65, 1.5, 7.0):
        assert shafts_turn_true(look(turns, driver=(order, SIZE))) == []


def test_gears_of_one_speed_have_one_order() -> None:
    """Twins of one another: the orders of both are one, and it keeps its whole size."""
    found = look(5.0, driver=(1, SIZE)).record
    turned = found.angle_driver.values[0]
    found["angle_driven"].values[0] = np.linspace(turned[0], turned[-1], turned.size)
    found.attrs.update(base_radius_driven=RADII["driver"], teeth_driven=20)
    (said,) = shafts_turn_true(Look(found))
    assert "holds 2 um at order 1 of the driver's shaft" in said.sentence
