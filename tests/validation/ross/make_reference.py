"""Mesh stiffness of a spur pair by ROSS's GearElementTVMS, stored with its geometry and parts. See README.md."""

from __future__ import annotations

import json
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from ross.gear_element import GearElementTVMS, Mesh
from ross.materials import steel

HERE = Path(__file__).parent
TEETH, MODULE, WIDTH, BORE, ALPHA = 62, 2e-3, 0.02, 0.0175, np.pi / 9
POINTS = 201  # over one mesh period


def parts(gear: GearElementTVMS, pressure: float) -> dict[str, float]:
    """Compliance of one tooth [m/N] at a pressure angle [rad]."""
    beta = gear._to_tau(pressure)
    return {
        "pressure_angle": float(pressure),
        "bending": float(gear._inv_kb(beta)),
        "shear": float(gear._inv_ks(beta)),
        "axial": float(gear._inv_ka(beta)),
        "foundation": float(gear._inv_kf(beta)),
    }


def main() -> None:
    options = {
        "material": steel,
        "width": WIDTH,
        "bore_diameter": 2 * BORE,
        "module": MODULE,
        "n_teeth": TEETH,
        "pr_angle": ALPHA,
    }
    mesh = Mesh(GearElementTVMS(n=0, **options), GearElementTVMS(n=1, **options))
    gear = mesh.driving_gear
    angles = gear.pr_angles_dict
    turn, stiffness = mesh.get_stiffness_for_mesh_period(n_points=POINTS)
    record = {
        "ross": version("ross-rotordynamics"),
        "numpy": np.__version__,
        "gear": {"teeth": TEETH, "module": MODULE, "width": WIDTH, "bore_radius": BORE, "pressure_angle": ALPHA},
        "material": {"youngs_modulus": steel.E, "shear_modulus": steel.G_s, "poisson": steel.Poisson},
        "contact_ratio": float(mesh.contact_ratio),
        "start_pressure_angle": float(angles["start_point"]),
        "tip_pressure_angle": float(angles["addendum"]),
        "root_half_angle": float(gear.tooth_dict["root_angle"]),
        "hertz": float(mesh.hertzian_stiffness),
        "tooth": [parts(gear, p) for p in np.linspace(angles["start_point"], angles["addendum"], 7)],
        "turn": [float(value) for value in turn],
        "stiffness": [float(value) for value in stiffness],
        "documented": {"least": 2.29e8, "most": 4.30e8},
    }
    partial = HERE / "reference.json.part"
    partial.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    partial.replace(HERE / "reference.json")


if __name__ == "__main__":
    sys.exit(main())
