"""What holds for all tests: their order, and one thread of linear algebra in each process, for they run side by side, a
process for every core."""

from __future__ import annotations

import gc
import os
from pathlib import Path

import pytest

# Before numpy is imported anywhere, and inherited by every process that a test starts.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")


TESTS = Path(__file__).parent
# Where nothing is compiled yet, the loops of the time steps take a minute: one process begins with them, the others
# with what does not need them; what does comes when they are there. (`--no-loadscope-reorder` keeps to this order.)
BEGIN, LAST = "fem/motion/test_effects.py", ("bench/", "fem/")


def turn(test: pytest.Item) -> int:
    """When a test is run: the lower the earlier."""
    file = test.path.relative_to(TESTS).as_posix()
    return 0 if file == BEGIN else 2 if file.startswith(LAST) else 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=turn)


def pytest_collection_finish() -> None:
    """Thousands of tests stay until the end: the collector of garbage need not look through them again and again."""
    gc.collect()
    gc.freeze()
