"""Where rig, solvers and records meet: experiments, static solutions, comparisons.

`models`: the list of models; `protocol`: what a model is; `experiment`: one experiment, whatever the model. `plan`:
schedule, torque, settling and workers. `record`: what a record says of its rig, sensors. `refusals`: what cannot be
asked for, found before work begins. `linear`, `nonlinear`, `elastic`, `full`: the models. `stress`: fields and root
stress. `results`: frequency responses of cases, single numbers, comparisons. `export`: models for other programs.
`study`: many members of one case, on processes or a cluster, and which factor decides.
`conversion`: measured files become records.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gearbench.bench.errors import BenchError

if TYPE_CHECKING:
    from gearbench.bench.conversion import convert
    from gearbench.bench.experiment import simulate
    from gearbench.bench.results.compare import Results, Row
    from gearbench.bench.results.comparison import Comparison, compare
    from gearbench.bench.statics import static

__all__ = ["BenchError", "Comparison", "Results", "Row", "compare", "convert", "simulate", "static"]

_HOMES = {
    "Comparison": "gearbench.bench.results.comparison",
    "Results": "gearbench.bench.results.compare",
    "Row": "gearbench.bench.results.compare",
    "compare": "gearbench.bench.results.comparison",
    "convert": "gearbench.bench.conversion",
    "simulate": "gearbench.bench.experiment",
    "static": "gearbench.bench.statics",
}


def __getattr__(name: str) -> Any:
    # Imported on use: the list of models alone should cost the command line nothing.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value
