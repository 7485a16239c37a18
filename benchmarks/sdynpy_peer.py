"""One run of sdynpy's `frf_local_model`; `local_polynomials.py` calls it with the interpreter that has sdynpy.

    PYTHON sdynpy_peer.py SPECTRA.npz EXPORT_RATIO

Knows nothing of gearbench. Only the one file of sdynpy is loaded (the package wants a display), with the line that
numpy 2 refuses, a range from a numpy bool, put right. Prints processor time and the file of what was found.
"""

from __future__ import annotations

import importlib.util
import json
import sys
import time
import types
from pathlib import Path
from typing import Any

import numpy as np

REFUSED, MENDED = "in range(is_lo,", "in range(int(is_lo),"


def local_model() -> Any:
    """The peer's function."""
    found = importlib.util.find_spec("sdynpy")
    if found is None or not found.submodule_search_locations:
        raise SystemExit("sdynpy is not installed there")
    path = Path(found.submodule_search_locations[0]) / "signal_processing" / "sdynpy_lrm.py"
    module = types.ModuleType("sdynpy_lrm")
    exec(compile(path.read_text().replace(REFUSED, MENDED), str(path), "exec"), module.__dict__)
    return module.frf_local_model


def main() -> None:
    """Run twice, time the second: the first starts its workers."""
    path, ratio = Path(sys.argv[1]), float(sys.argv[2])
    given = np.load(path)
    function = local_model()
    wanted = np.arange(int(given["first"]), int(given["last"]) + 1).astype(float)
    for _ in range(2):
        before = time.process_time()
        _, response, _ = function(
            given["references"],
            given["responses"][None],
            given["rows"].astype(float),
            wanted,
            bandwidth=95.0,
            transient=False,
            modelset=[[2, 0, 0]],
            export_ratio=ratio,
            max_parallel=1,
            print_time=False,
        )
        seconds = time.process_time() - before
    found = path.with_name("found.npy")
    np.save(found, response[:, 0])
    print(json.dumps({"seconds": seconds, "found": str(found)}))


if __name__ == "__main__":
    main()
