"""What is a crack, and what teeth of one sound gear differ by."""

from __future__ import annotations

from gearbench.challenge.truth.effects import SEVERITY
from gearbench.challenge.truth.levels import BACKGROUND, CRACK
from gearbench.diagnosis.effects.tooth_crack import SD, TOOTH_CRACK


def test_the_softest_tooth_of_a_sound_rig_is_no_crack() -> None:
    assert TOOTH_CRACK.least_size is not None
    least = TOOTH_CRACK.least_size * SD
    assert BACKGROUND[1] * CRACK + SD / 2 < least < SEVERITY[0] * CRACK / 1.5
