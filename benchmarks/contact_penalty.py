"""Contact of the elements' own surfaces (simulation.contact = "penalty") beside the contact law: cost and ripple.

    python benchmarks/contact_penalty.py [FOLDER]

prints the table of docs/physics.md, "Full model", and draws FOLDER/contact_penalty.png.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from shared.surface_cycles import Cycle, cycle

SIZES = (0.75e-3, 0.375e-3, 0.15e-3)
TORQUES = (30.0, 200.0)
POSITIONS = 96


def table(runs: dict[tuple[float, float], Cycle]) -> None:
    """Print a line for every element size."""
    print("element um | unknowns | prepared s | step ms | law ms | " + " | ".join(f"{t:g} N m" for t in TORQUES))
    for size in SIZES:
        first = runs[size, TORQUES[0]]
        parts = [f"{1e6 * size:.0f}", f"{first.unknowns}", f"{first.prepared:.1f}", f"{1e3 * first.step:.0f}"]
        parts.append(f"{1e3 * first.law_step:.0f}")
        for torque in TORQUES:
            off = runs[size, torque].off
            parts.append(f"mean {np.mean(off):+.1%}, ripple {np.std(off):.1%} rms, {np.ptp(off):.1%} peak to peak")
        print(" | ".join(parts))


def draw(path: Path, runs: dict[tuple[float, float], Cycle]) -> None:
    """Transmission error over the mesh phase."""
    figure, axes = plt.subplots(1, len(TORQUES), figsize=(11, 4.2))
    for axis, torque in zip(axes, TORQUES, strict=True):
        for size, colour in zip(SIZES, ("0.75", "tab:orange", "tab:blue"), strict=True):
            run = runs[size, torque]
            axis.plot(run.phase, 1e6 * run.surfaces, color=colour, lw=1.0, label=f"surfaces, {1e6 * size:.0f} um")
        axis.plot(run.phase, 1e6 * run.law, color="black", lw=1.6, label="contact law")
        axis.set_title(f"{torque:g} N m")
        axis.set_xlabel("mesh phase [cycles]")
        axis.set_ylabel("static transmission error [um]")
        axis.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    runs = {(size, torque): cycle(size, torque, POSITIONS) for size in SIZES for torque in TORQUES}
    table(runs)
    draw(folder / "contact_penalty.png", runs)


if __name__ == "__main__":
    main()
