"""Sizes of truth rigs and their effects on rigs of another size than the demonstration's.

The draws of `structure`, `levels` and `effects` are in metres, seconds and hertz of the demonstration's rig. On another
rig lengths go with the deflection of its mesh under the mean load, and frequencies with the resonance of its mesh: an
effect of severity 1 is then as large beside what the rig does anyway.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import Any

from gearbench.challenge.truth.effects import Parameters
from gearbench.challenge.truth.levels import Levels
from gearbench.challenge.truth.structure import Structure
from gearbench.geometry import pair
from gearbench.rig import Case

STIFFNESS = 18e9  # [N/m] of a mesh a metre wide, about what steel gears have
# Deflection [m] and resonance [Hz] of the demonstration's mesh by that number.
DEFLECTION, RESONANCE = 8.57e-6, 1902.0


@dataclass(frozen=True)
class Scale:
    """Lengths and frequencies over those of the demonstration's rig."""

    length: float = 1.0
    frequency: float = 1.0

    def structure(self, of: Structure) -> Structure:
        """A structure of the demonstration's size in this one."""
        return replace(
            of,
            profile=of.profile * self.length,
            damping_onset=of.damping_onset * self.length,
            friction_speed=of.friction_speed * self.length * self.frequency,
            mode_frequency=of.mode_frequency * self.frequency,
            shaft_frequency=of.shaft_frequency * self.frequency,
            governor_frequency=of.governor_frequency * self.frequency,
        )

    def levels(self, of: Levels) -> Levels:
        """Levels of the demonstration's size in this one."""
        length, frequency, foreign = self.length, self.frequency, of.foreign
        a, b, c, d = (delay / frequency for delay in of.delay)
        return replace(
            of,
            runout=(of.runout[0] * length, of.runout[1] * length),
            pitch=(of.pitch[0] * length, of.pitch[1] * length),
            coupling_frequency=of.coupling_frequency * frequency,
            delay=(a, b, c, d),
            backlash_more=of.backlash_more * length,
            encoder=(of.encoder[0] * length, of.encoder[1] * length),
            profile=(of.profile[0] * length, of.profile[1] * length),
            foreign=replace(
                foreign,
                tone_frequency=foreign.tone_frequency * frequency,
                filter_frequency=foreign.filter_frequency * frequency,
            ),
        )

    def parameters(self, of: Mapping[str, Parameters]) -> dict[str, Parameters]:
        """What an answer says of effects of the demonstration's size, in this one."""
        by_unit = {"um": self.length, "us": 1.0 / self.frequency, "Hz": self.frequency}

        def scaled(entry: Mapping[str, Any]) -> dict[str, Any]:
            return {**entry, "value": entry["value"] * by_unit.get(entry["unit"], 1.0)}

        return {effect: {name: scaled(one) for name, one in own.items()} for effect, own in of.items()}


def scale_of(nominal: Case) -> Scale:
    """The scale of a nominal case that a challenge can be built around, under its first condition."""
    rig, meshing = nominal.rig, pair(nominal.rig)
    first = nominal.conditions[0].experiment if nominal.conditions else nominal.experiment
    radius, stiffness = meshing.driver.base_radius, STIFFNESS * meshing.face_width
    assert rig.driver.inertia and rig.drive.coupling
    mass = (rig.driver.inertia + rig.drive.coupling.inertia) / radius**2
    deflection = first.torque_mean / radius / stiffness
    return Scale(deflection / DEFLECTION, sqrt(stiffness / mass) / (2 * pi) / RESONANCE)
