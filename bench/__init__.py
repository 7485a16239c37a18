"""Where rig, solvers and records meet: experiments, static solutions, comparisons.

`plan`: schedule, torque and workers of an experiment. `record`: what a record says of its rig, sensors. `refusals`:
what cannot be asked for, found before work begins. `linear`, `nonlinear`, `elastic`: experiments and statics on each
model. `stress`: fields and root stress. `results`: frequency responses of cases, single numbers, comparisons. `export`:
models for other programs.
"""

from gearbench.bench.convert import convert
from gearbench.bench.errors import BenchError
from gearbench.bench.results.compare import Results, Row
from gearbench.bench.results.comparison import Comparison, compare
from gearbench.bench.simulate import simulate
from gearbench.bench.static import static

__all__ = ["BenchError", "Comparison", "Results", "Row", "compare", "convert", "simulate", "static"]
