"""Local polynomial method beside sdynpy's `frf_local_model`, fed with the same shifted spectra, in one run.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benchmarks/local_polynomials.py --peer PYTHON

PYTHON is the interpreter of an environment of its own that has sdynpy, psutil and joblib (none of them is a dependency
of ours); without it that part is left out. One record of the reference system: 50 Hz mesh, one multisine of 4 s,
40 dB; L = 10, R = 2, n = 47, all 2401 lines of 900-1500 Hz. Both fit the same 6401 rows by polynomials of order 2 in
windows of 95 lines, without transients. sdynpy reads a part `export_ratio` of each window: 1/3 as we do, and 0.1, its
default. Processor times, ours and the peer's in turn, medians; the error is that of the ITF.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.estimate import local_polynomial, needed_rows
from gearbench.identification.lpm.regression import Window
from gearbench.identification.spectra.joint import Complexes, Spectra
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import itf_from_htf

ROOT = Path(__file__).resolve().parents[1]
PEER = Path(__file__).with_name("sdynpy_peer.py")
WINDOW = Window(harmonics=10, order=2, half_width=47, transient=False)
RATIOS = (1 / 3, 0.1)
PHASES, STEP = 128, 8


def reference() -> tuple[Spectra, NDArray[np.int64], Complexes]:
    """Spectra, output lines, and the exact ITF on every STEP-th of them."""
    sys.path.insert(0, str(ROOT / "tests"))
    from shared.reference_rig import ReferenceRig, reference_record

    rig = ReferenceRig(mesh_frequency=50.0)
    given = {"duration": 4.0, "sampling_rate": 16000.0, "band": (1.0, 5000.0), "noise": 0.01}
    record = reference_record(rig, realisations=1, **given)
    spectra, _, _ = record_spectra([record], top=1500.0, sidebands=2 * WINDOW.harmonics)
    lines = np.arange(3600, 6001)
    frequency = lines[::STEP] * spectra.spacing
    return spectra, lines, exact_itf(rig.system(512), frequency, np.arange(PHASES) / PHASES)


def shifted(spectra: Spectra, rows: NDArray[np.int64]) -> tuple[Complexes, Complexes]:
    """U(m + j d) (2L+1, rows) and Y(m) (rows,), without lines of the operating response."""
    both = []
    for one_sided in (spectra.force[0], spectra.dte[0]):
        full = np.concatenate([one_sided[:0:-1].conj(), one_sided])
        full[spectra.highest % spectra.mesh_lines :: spectra.mesh_lines] = 0.0
        both.append(full)
    j = np.arange(-WINDOW.harmonics, WINDOW.harmonics + 1)[:, None]
    return both[0][rows + j * spectra.mesh_lines + spectra.highest], both[1][rows + spectra.highest]


def branches(rows: NDArray[np.int64], found: Complexes, lines: NDArray[np.int64], d: int) -> Complexes:
    """G_l (2L+1, lines) from the peer's Gs_j (rows, 2L+1): G_l(k) = Gs_j(k - j d), l = -j."""
    result = np.zeros((WINDOW.branches, lines.size), dtype=complex)
    for j in range(-WINDOW.harmonics, WINDOW.harmonics + 1):
        result[WINDOW.harmonics - j] = found[lines - j * d - rows[0], WINDOW.harmonics + j]
    return result


def error(htf: Complexes, truth: Complexes) -> float:
    """Relative rms error of the ITF of branches on every STEP-th line."""
    return float(np.linalg.norm(itf_from_htf(htf[:, ::STEP], PHASES) - truth) / np.linalg.norm(truth))


def peer_run(python: str, given: Path, ratio: float) -> tuple[float, Complexes]:
    """Processor time [s] of one run of the peer, and what it found (rows, 2L+1). Raises RuntimeError without sdynpy."""
    done = subprocess.run([python, str(PEER), str(given), str(ratio)], capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "it says nothing")
    told = json.loads(done.stdout.splitlines()[-1])
    return float(told["seconds"]), np.load(told["found"])


def side_by_side(python: str | None, repeats: int) -> dict[str, Any]:
    """Medians of processor times [s] and errors of the ITF: "ours", and "sdynpy" by export_ratio where it can run."""
    spectra, lines, truth = reference()
    rows = needed_rows(lines, WINDOW.harmonics, spectra.mesh_lines)
    around = np.arange(rows[0] - 4 * WINDOW.half_width, rows[-1] + 4 * WINDOW.half_width + 1)
    own: list[float] = []
    theirs: dict[float, list[tuple[float, float]]] = {ratio: [] for ratio in RATIOS if python}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "spectra.npz"
        references, responses = shifted(spectra, around)
        np.savez(path, references=references, responses=responses, rows=around, first=rows[0], last=rows[-1])
        result = local_polynomial(spectra, lines, WINDOW)
        for _ in range(repeats):
            before = time.process_time()
            result = local_polynomial(spectra, lines, WINDOW)
            own.append(time.process_time() - before)
            for ratio, runs in theirs.items():
                seconds, found = peer_run(str(python), path, ratio)
                runs.append((seconds, error(branches(rows, found, lines, spectra.mesh_lines), truth)))
    peer = {ratio: [float(x) for x in np.median(runs, axis=0)] for ratio, runs in theirs.items()}
    return {"ours": [float(np.median(own)), error(result.htf, truth)], "windows": result.windows, "sdynpy": peer}


def main() -> None:
    """Print medians, ratios and errors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--peer", metavar="PYTHON", help="interpreter that has sdynpy")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="print numbers only")
    given = parser.parse_args()
    if given.peer is None:
        print("sdynpy left out: --peer names the interpreter of an environment that has it", file=sys.stderr)
    try:
        found: dict[str, Any] = side_by_side(given.peer, given.repeats)
    except (RuntimeError, OSError) as trouble:
        print(f"sdynpy left out: {given.peer} cannot run it: {trouble}", file=sys.stderr)
        found = side_by_side(None, given.repeats)
    if given.json:
        print(json.dumps(found))
        return
    mine, ours = found["ours"]
    print(f"ours: {mine:.3f} s with variances, {found['windows']} windows, error {ours:.2%}")
    for ratio, (spent, theirs) in found["sdynpy"].items():
        print(f"sdynpy, export_ratio {ratio:.2g}: {spent:.2f} s, error {theirs:.2%}; {spent / mine:.1f} times ours")


if __name__ == "__main__":
    main()
