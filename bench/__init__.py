"""Where rig, solvers and records meet: experiments, static solutions, comparisons.

`models`: the list of models; `protocol`: what a model is; `experiment`: one experiment, whatever the model;
`realisations`, `finish`: its realisations and their record. `plan`:
schedule, torque, settling and workers. `record`: what a record says of its rig, sensors. `refusals`: what cannot be
asked for, found before work begins. `linear`, `nonlinear`, `elastic`, `full`: the models. `replays`: records on the
reduced one. `stress`: fields and root stress. `results`: frequency responses of cases, single numbers, comparisons.
`export`: models for other programs. `study`: many members of one case, on processes or a cluster, and which factor
decides. `conversion`: measured files become records.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearbench.bench.errors import BenchError
from gearbench.files import names_on_use

if TYPE_CHECKING:
    from gearbench.bench.conversion import convert
    from gearbench.bench.experiment import simulate, simulate_to
    from gearbench.bench.results.compare import Results, Row
    from gearbench.bench.results.comparison import Comparison, compare
    from gearbench.bench.statics import static

__all__ = ["BenchError", "Comparison", "Results", "Row", "compare", "convert", "simulate", "simulate_to", "static"]

_HOMES = {
    "Comparison": "gearbench.bench.results.comparison",
    "Results": "gearbench.bench.results.compare",
    "Row": "gearbench.bench.results.compare",
    "compare": "gearbench.bench.results.comparison",
    "convert": "gearbench.bench.conversion",
    "simulate": "gearbench.bench.experiment",
    "simulate_to": "gearbench.bench.experiment",
    "static": "gearbench.bench.statics",
}

# Imported on use: the list of models alone should cost the command line nothing.
__getattr__ = names_on_use(__name__, _HOMES)
