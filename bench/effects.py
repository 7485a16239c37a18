"""Which model a rig needs: effects that only some of them represent."""

from __future__ import annotations

from gearbench.bench.errors import BenchError
from gearbench.rig import Case, Rig
from gearbench.rig.neutral import effects_in


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
