"""Analytic stiffness: the worked example of ISO 6336, Weber-Banaschek behind it, and the published programme ROSS."""

from __future__ import annotations

import json
from functools import cache
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.commands.house.checks import Check, NotRun
from gearbench.geometry import Pair, pair
from gearbench.lumped.stiffness.iso6336 import (
    basic_rack_factor,
    contact_ratio,
    flexibility,
    mesh_stiffness,
    single_stiffness,
    virtual_teeth,
)
from gearbench.lumped.stiffness.potential_energy import foundation_polynomials, hertz_compliance, tooth_compliance
from gearbench.lumped.stiffness.weber_banaschek import pair_stiffness
from gearbench.rig import Gear, Material, Rig, Support, Supports

Array = NDArray[np.float64]
DEGREE = pi / 180
STORED = Path(__file__).parent / "ross" / "reference.json"

# ISO/TR 6336-30:2017, example 1: c'_th, c', c_gamma-alpha [N/(mm um)]. The basic rack is profile D of ISO 53
# (h_fP = 1.4 modules); the tip diameters are those of addendum 1 without shortening, rounded to 0.01 mm.
ISO_EXAMPLE = (17.85584, 12.37047, 17.46485)
TEETH, SHIFTS, MODULE, HELIX = (17, 103), (0.145, 0.0), 8.0, 15.8 * DEGREE
TIPS, CENTRE_DISTANCE = (159.66, 872.35), 500.0

# Teeth, shifts and dedendum of pairs inside the range of the ISO series.
FITTED = (
    (62, 62, 0.0, 0.0, 1.2),
    (62, 62, 0.0, 0.0, 1.25),
    (20, 40, 0.3, -0.1, 1.2),
    (20, 40, 0.3, -0.1, 1.25),
    (30, 30, 0.5, 0.5, 1.2),
    (100, 100, 0.0, 0.0, 1.2),
    (25, 100, 0.2, 0.0, 1.2),
)


def iso_6336() -> float:
    """Largest relative error of the three stiffnesses of the example."""
    virtual = [virtual_teeth(z, HELIX) for z in TEETH]
    theoretical = 1 / flexibility(virtual, SHIFTS)
    single = single_stiffness(theoretical, rack=basic_rack_factor(1.4, 20 * DEGREE), helix=HELIX)
    mesh = mesh_stiffness(single, contact_ratio(TEETH, MODULE, TIPS, CENTRE_DISTANCE, HELIX))
    found = (theoretical, single, mesh)
    return max(abs(got / wanted - 1) for got, wanted in zip(found, ISO_EXAMPLE, strict=True))


def rig_of(driver: Gear, driven: Gear, material: Material) -> Rig:
    """A rig whose supports do not matter."""
    support = Support(stiffness=1e8)
    return Rig(driver=driver, driven=driven, material=material, support=Supports(driver=support, driven=support))


def weber_banaschek() -> float:
    """Largest stiffness of a pair at 300 N/mm in plane strain against c'_th C_B, which was fitted to it."""
    worst = 0.0
    for z1, z2, x1, x2, dedendum in FITTED:
        gears = [
            Gear(
                teeth=z,
                profile_shift=x,
                module=4e-3,
                face_width=0.04,
                hub_radius=1e-3 * z,
                dedendum=dedendum,
                rack_tip_radius=0.25,
                tip_edge_radius=0.0,
            )
            for z, x in ((z1, x1), (z2, x2))
        ]
        rig = rig_of(*gears, Material(state="plane-strain"))
        meshing = pair(rig)
        rho = np.linspace(*meshing.active_driver, 101)
        theory = pair_stiffness(rig, meshing, rho, 300e3 * meshing.face_width).max() / meshing.face_width / 1e9
        worst = max(worst, abs(basic_rack_factor(dedendum, 20 * DEGREE) / flexibility((z1, z2), (x1, x2)) / theory - 1))
    return worst


@cache
def ross() -> tuple[dict[str, Any], Rig, Pair]:
    """ROSS's stored numbers and the same pair here; ROSS's rack tip is fully rounded."""
    if not STORED.is_file():
        raise NotRun(f"{STORED.name} is missing")
    kept = json.loads(STORED.read_text(encoding="utf-8"))
    stored, steel = kept["gear"], kept["material"]
    gear = Gear(
        teeth=stored["teeth"],
        module=stored["module"],
        face_width=stored["width"],
        hub_radius=stored["bore_radius"],
        bore_radius=stored["bore_radius"],
        rack_tip_radius=0.25 / (1 - np.sin(stored["pressure_angle"])),
        tip_edge_radius=0.0,
    )
    rig = rig_of(gear, gear, Material(youngs_modulus=steel["youngs_modulus"], poisson=steel["poisson"]))
    return kept, rig, pair(rig)


def one_tooth(rho: Array, root_half_angle: float) -> Array:
    """Compliance of a tooth [m/N], its foundation's lever reaching to the height of the contact point, as in ROSS,
    and not to where the line of action crosses the axis."""
    kept, rig, meshing = ross()
    tooth, gear = meshing.driver, rig.driver
    own = tooth_compliance(tooth, gear.hub_radius, gear.face_width, rig.material, rho)
    beta = rho / tooth.base_radius - tooth.psi_b
    lever = (tooth.involute(rho)[:, 0] - tooth.root_radius) / (2 * tooth.root_radius * root_half_angle)
    el, em, pe, qu = foundation_polynomials(tooth.root_radius / gear.hub_radius, root_half_angle)
    shape = el * lever**2 + em * lever + pe * (1 + qu * np.tan(beta) ** 2)
    foundation = np.cos(beta) ** 2 / (kept["material"]["youngs_modulus"] * gear.face_width) * shape
    return own.bending + own.shear + own.axial + foundation


def one_pair(driver: Array, driven: Array, root_half_angle: float) -> Array:
    """Stiffness [N/m] of a pair whose teeth touch at those roll lengths [m]."""
    _, rig, _ = ross()
    teeth = one_tooth(driver, root_half_angle) + one_tooth(driven, root_half_angle)
    return 1 / (teeth + hertz_compliance(rig.material, rig.driver.face_width))


def ross_shortcuts() -> float:
    """Largest relative difference over the mesh period, with ROSS's path of contact, lever and root angle."""
    kept, _, meshing = ross()
    start, tip, ratio = kept["start_pressure_angle"], kept["tip_pressure_angle"], kept["contact_ratio"]
    cycle = (tip - start) / ratio
    base = meshing.driver.base_radius

    def single(turn: Array) -> Array:
        return one_pair(base * np.tan(start + turn), base * np.tan(tip - turn), kept["root_half_angle"])

    at = np.array(kept["turn"]) / kept["turn"][-1]
    found = single(at * cycle)
    double = at <= ratio - 1
    found[double] += single((at[double] + 1) * cycle)
    return float(np.abs(found / kept["stiffness"] - 1).max())


def ross_true_path() -> float:
    """Largest relative difference of least and most stiffness; path of contact and root angle are the true ones."""
    kept, _, meshing = ross()
    tooth = meshing.driver
    first, last = meshing.active_driver
    angle = pi / tooth.teeth - tooth.root_half_angle

    def single(rho: Array) -> Array:
        return one_pair(rho, meshing.line_of_action - rho, angle)

    rho = first + meshing.base_pitch * np.linspace(0.0, 1.0, 2000, endpoint=False)
    found = single(rho)
    double = rho + meshing.base_pitch <= last
    found[double] += single(rho[double] + meshing.base_pitch)
    wanted = kept["stiffness"]
    ratio = abs(meshing.contact_ratio / kept["contact_ratio"] - 1)
    return max(ratio, abs(found.min() / min(wanted) - 1), abs(found.max() / max(wanted) - 1))


CHECKS = [
    Check("iso-6336", "ISO/TR 6336-30 example 1: c'_th, c', c_gamma-alpha", 1e-4, "", iso_6336),
    Check("weber-banaschek", "Weber-Banaschek at 300 N/mm against ISO's fit to it, 7 pairs", 0.04, "", weber_banaschek),
    Check("ross-shortcuts", "potential energy with ROSS's shortcuts against ROSS, 62/62", 1e-4, "", ross_shortcuts),
    Check(
        "ross",
        "potential energy on the true path, ROSS's foundation lever, against ROSS, 62/62",
        0.03,
        "",
        ross_true_path,
    ),
]
