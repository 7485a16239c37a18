"""Which model a rig needs: effects that only some of them represent."""

from __future__ import annotations

from gearbench.bench.errors import BenchError
from gearbench.rig import Case, Rig
from gearbench.rig.neutral import effects_in

# What the non-linear lumped model represents; a key counts with all keys below it.
LUMPED = tuple(
    f"rig.{key}"
    for key in (
        *(f"{side}.{name}" for side in ("driver", "driven") for name in ("pitch_error_um", "runout_um", "crack")),
        "support.driver.exponent",
        "support.driven.exponent",
        "drive.coupling",
        "drive.ripple",
        "friction.coefficient",
        "mesh.",
        "sensors.",
    )
)


def is_nonlinear(case: Case) -> bool:
    """Whether the lumped model of a case is the non-linear one: it has effects, or a mesh law from finite elements."""
    return case.simulation.mesh_stiffness == "finite-element" or bool(effects_in(case.rig))


def refuse_effects(rig: Rig, model: str, tables: tuple[str, ...] = ("rig",)) -> None:
    """Raise BenchError for the first effect, in the given tables of a case, that a model cannot represent."""
    for key in effects_in(rig):
        if any(key.startswith(table) for table in tables):
            raise BenchError(
                f"the {model} does not represent {key}: leave it at its neutral value, or set simulation.model ="
                ' "lumped", which has it'
            )


def refuse_unknown(rig: Rig) -> None:
    """Raise BenchError for the first effect that the non-linear lumped model does not represent either."""
    for key in effects_in(rig):
        if not key.startswith(LUMPED):
            raise BenchError(f"the lumped model does not represent {key}: leave it at its neutral value")
