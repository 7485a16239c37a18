"""One thread of linear algebra in each process: tests run side by side, a process for every core."""

from __future__ import annotations

import os

# Before numpy is imported anywhere, and inherited by every process that a test starts.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
