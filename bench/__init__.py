"""Where rig, solvers and records meet."""

from gearbench.bench.errors import BenchError
from gearbench.bench.simulate import simulate

__all__ = ["BenchError", "simulate"]
