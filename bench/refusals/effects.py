"""Which model a rig needs: effects that only some of them represent."""

from __future__ import annotations

from collections.abc import Collection

from gearbench.bench.errors import BenchError
from gearbench.rig import Case, Gear, Rig
from gearbench.rig.neutral import FLANK_FIELDS, effects_in
from gearbench.rig.value import key_of

SIDES = ("driver", "driven")

# Keys of a gear that move its flanks: what finite elements represent, but for what changes stiffness.
FLANK_KEYS = frozenset(f"rig.{side}.{key_of(Gear, name)}" for side in SIDES for name in FLANK_FIELDS)

# What finite elements represent beside the flanks at rest: a crack that is in the mesh.
ELASTIC_KEYS = FLANK_KEYS | {f"rig.{side}.crack.length_mm" for side in SIDES}

# What they represent in motion: all but a crack that is a number only.
MOVING_KEYS = ("rig.support.", "rig.housing", "rig.drive.", "rig.load.", "rig.friction.", "rig.mesh.")

# What moves the flanks of all teeth of a gear alike, which the lumped model's law of the mesh has.
FORMS = ("tip_relief_um", "root_relief_um", "profile_slope_um", "profile_form_um", "wear_um", "wear_depth_um")
# Factors on them, tooth by tooth, which it has only where they are all the same.
FACTORS = ("profile_form_tooth", "wear_tooth")

# What the non-linear lumped model represents; a key counts with all keys below it.
LUMPED = tuple(
    f"rig.{key}"
    for key in (
        *(f"{side}.{name}" for side in SIDES for name in ("pitch_error_um", "runout_um", "crack", *FORMS)),
        *(f"support.{side}.{name}" for side in SIDES for name in ("exponent", "across")),
        "housing",
        *("drive.boundary", "drive.coupling", "drive.ripple"),
        *("load.boundary", "load.coupling"),
        "friction.coefficient",
        "damping.mesh_exponent",
        "mesh.",
        "sensors.",
    )
)


def is_nonlinear(case: Case) -> bool:
    """Whether the lumped model of a case is the non-linear one: it has effects, a mesh law from finite elements, or a
    speed that changes."""
    law = case.simulation.mesh_stiffness == "finite-element"
    return law or case.experiment.changes_speed or bool(effects_in(case.rig))


def refuse_effects(rig: Rig, model: str, tables: tuple[str, ...] = ("rig",), represented: Collection[str] = ()) -> None:
    """Raise BenchError for the first effect, in the given tables of a case, that a model cannot represent. Sensors are
    the bench's, whatever the model."""
    for key in effects_in(rig):
        if key.startswith("rig.sensors."):
            continue
        if any(key.startswith(table) for table in tables) and not represents(key, represented):
            if _is_crack(key, "crack"):
                raise BenchError(
                    f"the {model} does not represent {key}.stiffness_loss: give the crack itself, length_mm and"
                    ' direction_deg in its place, or set simulation.model = "lumped"'
                )
            raise BenchError(
                f"the {model} does not represent {key}: leave it at its neutral value, or set simulation.model ="
                ' "lumped", which has it'
            )


def represents(key: str, represented: Collection[str]) -> bool:
    """Whether a key is among those represented, or below one that ends in a dot."""
    return key in represented or any(one.endswith(".") and key.startswith(one) for one in represented)


def _is_crack(key: str, field: str) -> bool:
    return key in (f"rig.driver.{field}", f"rig.driven.{field}")


def refuse_unknown(rig: Rig) -> None:
    """Raise BenchError for the first effect that the non-linear lumped model does not represent either."""
    for key in effects_in(rig):
        if _is_crack(key, "crack.length_mm"):
            raise BenchError(
                f"the lumped model does not represent {key}: give the crack's stiffness_loss in its place (`check`"
                ' prints it), or set simulation.model = "reduced"'
            )
        if not key.startswith(LUMPED):
            raise BenchError(f"the lumped model does not represent {key}: leave it at its neutral value")
    for side in SIDES:
        for name in FACTORS:
            factors = getattr(getattr(rig, side), name)
            if len(set(factors)) > 1:
                raise BenchError(
                    f"the lumped model gives all teeth the same flanks, but rig.{side}.{name} runs from"
                    f' {min(factors):g} to {max(factors):g}: leave it out, or set simulation.model = "reduced"'
                )
