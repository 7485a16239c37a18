"""One thread of linear algebra in each process: tests run side by side, a process for every core."""

from __future__ import annotations

import gc
import os

# Before numpy is imported anywhere, and inherited by every process that a test starts.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")


def pytest_collection_finish() -> None:
    """Thousands of tests stay until the end: the collector of garbage need not look through them again and again."""
    gc.collect()
    gc.freeze()
