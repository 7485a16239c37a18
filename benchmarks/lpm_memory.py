"""Peak memory of the local polynomial method on a long record: L = 150 branches, 100 realisations, 2^17 lines.

Force and dte of 100 x 2^18 samples alone are 0.39 GiB, and their spectra as much again; what is solved besides is
bounded by windows that are gathered a few at a time. Prints gibibytes and processor time; `--json` for programs.
"""

from __future__ import annotations

import argparse
import json
import resource
import time

import numpy as np
import xarray as xr

from gearbench.identification import IdentificationSettings, identify
from gearbench.records import make_record

REALISATIONS, SAMPLES, MESH_LINES, RATE = 100, 2**18, 16, 65536.0
# Output lines, high enough that no spectrum ends early: they fill every chunk of windows, and more of them take longer
# and no more memory.
BAND = (25000.0, 25050.0)


def record(realisations: int) -> xr.Dataset:
    """The response, by circular convolution, of a band-pass filter behind a gain that switches with the mesh."""
    rng = np.random.default_rng(0)
    phase = np.arange(SAMPLES) * MESH_LINES / SAMPLES % 1.0
    gain = 1.0 + 0.3 * np.tanh(40.0 * np.sin(2 * np.pi * phase))
    lines = np.exp(-0.5 * ((np.arange(SAMPLES // 2 + 1) / SAMPLES - 0.38) / 0.02) ** 2)
    force, dte = np.empty((2, realisations, SAMPLES))
    for row in range(realisations):
        force[row] = rng.standard_normal(SAMPLES)
        dte[row] = 1e-9 * np.fft.irfft(np.fft.rfft(gain * force[row]) * lines, SAMPLES)
    attributes = {"sampling_rate": RATE, "samples_per_period": SAMPLES, "periods": 1, "settling_residual": 0.0}
    return make_record({"dte": dte, "force": force}, {**attributes, "mesh_period": SAMPLES / MESH_LINES / RATE})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    wanted = parser.parse_args()
    settings = IdentificationSettings(
        harmonics=150, order=1, window=4, band=BAND, phases=16, modes=0, accept_doubts=True
    )
    measured = record(REALISATIONS)
    before = time.process_time()
    identify([measured], settings)
    told = {
        "peak_gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "processor_s": time.process_time() - before,
    }
    print(json.dumps(told) if wanted.json else f"{told['peak_gib']:.2f} GiB, {told['processor_s']:.0f} s")


if __name__ == "__main__":
    main()
