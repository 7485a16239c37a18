"""Compilation of the inner loops.

Numba renews a cached function when its own file changes, not when a function that it calls in another file does. Each
state of these sources therefore has a cache folder of its own: machine code can never be older than what it calls.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba

from gearbench.kernels.trust import trusted

# Division by zero gives infinity, as in numpy; nobody calls these through C function pointers.
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def cache_folder() -> Path:
    """GEARBENCH_CACHE, or `gearbench` in the user's cache folder. Raises CacheError where others can write to it."""
    if own := os.environ.get("GEARBENCH_CACHE"):
        return trusted(Path(own))
    return trusted(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "gearbench")


@lru_cache(maxsize=1)
def sources_digest() -> str:
    """Hash of the Python sources of this package."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
    return digest.hexdigest()


def compiled(function: Callable[..., Any]) -> Any:
    """`numba.njit` that releases the interpreter lock and keeps its machine code in this state's folder.

    Where that folder cannot be written the function is compiled anew in every process.
    """
    config: Any = numba.config
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_folder() / f"compiled-{sources_digest()[:16]}")
    try:
        return numba.njit(function, cache=True, **OPTIONS)
    except RuntimeError:
        return numba.njit(function, **OPTIONS)
    finally:
        config.CACHE_DIR = before
