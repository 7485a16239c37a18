"""Where rig, solvers and records meet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gearbench.bench.errors import BenchError

if TYPE_CHECKING:
    from gearbench.bench.experiment import simulate

__all__ = ["BenchError", "simulate"]


def __getattr__(name: str) -> Any:
    # Imported on use: the list of models alone should cost the command line nothing.
    if name == "simulate":
        from gearbench.bench.experiment import simulate

        return simulate
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
