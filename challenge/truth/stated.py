"""What an answer says of effects whose draws are relative, in the units in which a verdict states them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gearbench.challenge.truth.effects import Parameters
from gearbench.challenge.truth.structure import Structure
from gearbench.geometry import pair
from gearbench.rig import Case

# Exponent of force over deflection of the nominal teeth, as finite elements have them at 0.3 to 1.8 times the mean
# torque: 0.036 to 0.057 on drivers of 18 to 54 teeth. A verdict counts from there.
TEETH = 0.05


def stated(drawn: Mapping[str, Parameters], structure: Structure, nominal: Case) -> dict[str, Parameters]:
    """The parameters of all effects of a rig."""
    rig, meshing = nominal.rig, pair(nominal.rig)
    radius = {"driver": meshing.driver.base_radius, "driven": meshing.driven.base_radius}

    def one(effect: str, name: str, entry: Mapping[str, Any]) -> dict[str, Any]:
        value, side = entry["value"], name.partition(".")[0]
        if effect == "contact-nonlinearity":
            return {"value": (1.0 + structure.exponent + value) / (1.0 + TEETH) - 1.0, "unit": "1"}
        if effect == "encoder-runout":
            return {"value": value / radius[side], "unit": "urad"}
        if effect == "support-stiffness":
            return {"value": value * getattr(rig.support, side).stiffness, "unit": "N/m"}
        if effect == "mesh-damping":
            return {"value": value * rig.damping.mesh_ratio, "unit": "1"}
        return dict(entry)

    return {effect: {name: one(effect, name, entry) for name, entry in own.items()} for effect, own in drawn.items()}
