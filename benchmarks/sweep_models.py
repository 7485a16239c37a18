"""Speed up and down by the reduced model and by the non-linear lumped one on the same tables.

    python benchmarks/sweep_models.py [FOLDER]

sweeps rig_62 from 500 to 6000 rpm with both (some minutes) and draws FOLDER/sweep_models.png.
"""

from __future__ import annotations

import sys
import time
from math import pi
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import xarray as xr

from gearbench.bench.sweep import sweep
from gearbench.cases import read_case

SPEEDS = np.linspace(500.0, 6000.0, 45) * pi / 30
COLOURS = {"reduced": "tab:blue", "lumped": "tab:orange"}


def draw(path: Path, results: dict[str, xr.Dataset]) -> None:
    """Rms of the DTE and dynamic factor of both models over speed."""
    figure, axes = plt.subplots(2, 1, figsize=(8.5, 7.0), sharex=True)
    for model, result in results.items():
        rpm = result["speed"].values * 30 / pi
        for number, style in enumerate(("-", "--")):
            name = f"{model}, {('up', 'down')[number]}"
            axes[0].plot(rpm, 1e6 * result["dte_rms"].values[number], style, color=COLOURS[model], label=name)
            axes[1].plot(rpm, result["dynamic_factor"].values[number], style, color=COLOURS[model])
    axes[1].plot(rpm, result["iso_dynamic_factor"].values, color="0.5", label="ISO 6336-1 Method B, K_v")
    axes[0].set_ylabel("DTE, rms [um]")
    axes[1].set_ylabel("largest mesh force / static")
    axes[1].set_xlabel("driver speed [1/min]")
    axes[0].legend()
    axes[1].legend()
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    results = {}
    for model in COLOURS:
        began = time.process_time()
        results[model] = sweep(read_case("rig_62"), list(SPEEDS), model)
        print(f"{model}: {len(SPEEDS)} speeds up and down in {time.process_time() - began:.0f} s of processor time")
    draw(folder / "sweep_models.png", results)


if __name__ == "__main__":
    main()
