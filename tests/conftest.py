"""Settings of every test, made before NumPy is imported."""

from __future__ import annotations

import os

# As on the command line: on many small matrices several BLAS threads wait for one another.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
