"""What a sound gear has of pitch errors: as its teeth are loaded, and no less than it can be made with."""

from __future__ import annotations

from dataclasses import replace

import pytest
from shared.measured import nominal

from gearbench.diagnosis.effects.pitch_error import unknowns
from gearbench.diagnosis.forces.nominal import NominalModel, nominal_model

LOAD = 100.0  # N m


@pytest.fixture(scope="module")
def model() -> NominalModel:
    return nominal_model(nominal(), 2.2 * LOAD, LOAD)


@pytest.mark.parametrize(
    ("module", "teeth", "load", "sound"),
    [
        # Of grade 1, worked by hand: 0.1 (0.001 d + 0.4 m + 5) um/4, rounded to 0.01 um.
        (3.0, (20, 30), 0.1 * LOAD, (0.16e-6, 0.16e-6)),
        (8.0, (20, 120), 0.1 * LOAD, (0.21e-6, 0.23e-6)),
        # The standard ends at 5 mm and half a module, gears do not.
        (0.2, (8, 20), 0.1 * LOAD, (0.13e-6, 0.13e-6)),
    ],
)
def test_no_gear_is_better_than_it_can_be_made(
    model: NominalModel, module: float, teeth: tuple[int, int], load: float, sound: tuple[float, float]
) -> None:
    law = replace(model.law, base_pitch=model.law.base_pitch * module / 3.0)
    light = replace(model, teeth=teeth, torque_mean=load, law=law)
    assert 0.04 * light.deflection < 0.1e-6
    for group, wanted, count in zip(unknowns(light, ()), sound, teeth, strict=True):
        # The module is told by the base pitch, which may be a step of the rounding less.
        assert group.sd == pytest.approx(count * [wanted], abs=0.0101e-6)
        assert (group.wide >= 3.0 * group.sd).all()


def test_sound_gears_are_as_uneven_as_they_are_loaded(model: NominalModel) -> None:
    assert [one.sd[0] for one in unknowns(model, ())] == pytest.approx(2 * [0.04 * model.deflection])
    heavy = replace(model, torque_mean=4 * LOAD)
    assert [one.sd[0] for one in unknowns(heavy, ())] == pytest.approx(2 * [0.16 * model.deflection])
