"""The list of models: what a case may be simulated with. Each is imported on use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from gearbench.bench.errors import BenchError

if TYPE_CHECKING:
    from gearbench.bench.protocol import Model
    from gearbench.rig import Case


def _lumped(case: Case) -> Model:
    from gearbench.bench.refusals.effects import is_nonlinear

    if is_nonlinear(case):
        from gearbench.bench.nonlinear.model import NonLinear

        return NonLinear()
    from gearbench.bench.linear.model import Linear

    return Linear()


def _reduced(case: Case) -> Model:
    from gearbench.bench.elastic.model import Reduced

    return Reduced()


def _full(case: Case) -> Model:
    from gearbench.bench.full.model import Unreduced

    return Unreduced()


# Values of simulation.model, and what a case with that value runs on.
MODELS: Mapping[str, Callable[[Case], Model]] = {"lumped": _lumped, "reduced": _reduced, "full": _full}


def model_for(case: Case, name: str | None = None) -> tuple[Case, Model]:
    """The case with its simulation.model replaced by `name` (absent: its own), and the model that it runs on.

    Raises BenchError for an unknown model, and for a contact or outputs that only others have.
    """
    name = name or case.simulation.model
    if name not in MODELS:
        raise BenchError(f"simulation.model = {name!r} is not one of {', '.join(MODELS)}")
    if case.simulation.contact == "penalty" and name != "full":
        raise BenchError(
            f'simulation.contact = "penalty" is of the model "full" only, and simulation.model = "{name}": set one of'
            " them"
        )
    if case.simulation.outputs == "teeth" and name == "lumped":
        raise BenchError(
            'simulation.outputs = "teeth" needs tooth pairs of their own, which simulation.model = "lumped" lacks: set'
            ' "motion", or the model "reduced" or "full"'
        )
    chosen = case.model_copy(update={"simulation": case.simulation.model_copy(update={"model": name})})
    return chosen, MODELS[name](chosen)
