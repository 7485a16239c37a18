"""What no local polynomial model can do better on one record, with the true branches in hand.

The reference system at 50 Hz mesh and one period of 4 s, lines 0.25 Hz apart. A model of L branches a side and order R
has (2L+1)(R+1) unknowns and needs as many lines: windows of that width, however well the equations are solved, leave
what polynomials do not follow in the true branches, and those beyond L are not there. Noise, and what branches lend one
another, come on top. Run: python -P benchmarks/local_model_bound.py
"""

from __future__ import annotations

import sys
from math import ceil
from pathlib import Path

import numpy as np
from numpy.polynomial.legendre import legvander

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from shared.reference_rig import ReferenceRig

from gearbench.identification import exact_itf

SPACING, BAND, PHASES, GRID = 0.25, (700.0, 2500.0), 256, 1.0
BRANCHES = (22, 27, 33, 37, 41, 44, 47, 50)
ORDERS = (1, 2, 3, 4, 5, 6)


def not_followed(branches: np.ndarray, inside: np.ndarray, half: int, order: int) -> float:
    """Power of the true `branches` (frequency, branch) less the local polynomial of `order` through each window of
    2 half + 1 frequencies, at its middle, over the frequencies `inside`."""
    place = np.arange(-half, half + 1) / half
    middle = legvander(np.zeros(1), order) @ np.linalg.pinv(legvander(place, order))
    return float(
        sum(np.sum(np.abs(middle[0] @ branches[k - half : k + half + 1] - branches[k]) ** 2) for k in inside)
    )


def main() -> None:
    margin = 100.0
    frequency = np.arange(BAND[0] - margin, BAND[1] + margin + GRID, GRID)
    rig = ReferenceRig(mesh_frequency=50.0)
    response = np.fft.fft(exact_itf(rig.system(512), frequency, np.arange(PHASES) / PHASES), axis=1) / PHASES
    order_of = np.abs(np.fft.fftfreq(PHASES, 1 / PHASES))
    inside = np.flatnonzero((frequency >= BAND[0]) & (frequency <= BAND[1]))
    power = float(np.sum(np.abs(response[inside]) ** 2))
    print("   L  beyond L   least of both for R = " + ", ".join(map(str, ORDERS)))
    for count in BRANCHES:
        kept = order_of <= count
        beyond = float(np.sum(np.abs(response[inside][:, ~kept]) ** 2))
        totals = []
        for order in ORDERS:
            half = ceil(((2 * count + 1) * (order + 1) - 1) / 2 * SPACING / GRID)
            totals.append(np.sqrt((beyond + not_followed(response[:, kept], inside, half, order)) / power))
        print(f"{count:4d}    {np.sqrt(beyond / power):6.2%}   " + "  ".join(f"{total:6.2%}" for total in totals))


if __name__ == "__main__":
    main()
