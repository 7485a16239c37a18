"""Static contact: mesh independence, ripple, torque ratio, and the stored CalculiX pairs."""

from __future__ import annotations

from functools import cache

import numpy as np

from gearbench.commands.house.checks import Check
from gearbench.fem.contact.law import Law, elastic_pair, make_law
from gearbench.fem.contact.static import static_cycle
from gearbench.fem.gear.body import condense
from gearbench.geometry import Pair
from gearbench.geometry.mesh.sector import Element
from gearbench.rig import Gear, Material, Rig, Support, Supports

MILLIMETRE = 1e-3
SUPPORT = Support(stiffness=1e8)
PHASES = np.arange(64) / 64


def rig(z1: int, z2: int, module: float, x1: float, x2: float, state: str) -> Rig:
    """A pair whose hubs are well below the roots, with 0.05 mm of thinning a gear."""

    def gear(z: int, x: float) -> Gear:
        return Gear(
            teeth=z,
            module=module,
            profile_shift=x,
            face_width=10 * module,
            hub_radius=0.28 * z * module,
            thinning=50e-6,
        )

    return Rig(
        driver=gear(z1, x1),
        driven=gear(z2, x2),
        material=Material.model_validate({"state": state}),
        support=Supports(driver=SUPPORT, driven=SUPPORT),
    )


RIGS = {
    "62/62": rig(62, 62, 2 * MILLIMETRE, 0.0, 0.0, "plane-stress"),
    "20/40": rig(20, 40, 3 * MILLIMETRE, 0.3, -0.1, "plane-strain"),
}
TORQUE_PER_WIDTH = 2e3  # of both pairs [N]


@cache
def law(name: str, refinement: float = 1, element: Element = "triangle") -> Law:
    """Contact law on the default mesh, a refined or a coarser one."""
    chosen = RIGS[name]
    meshing = elastic_pair(chosen)
    driver, driven = (
        condense(g, chosen.material, g.module / (12 * refinement), 0, element) for g in (chosen.driver, chosen.driven)
    )
    return make_law(meshing, driver, driven, chosen.material)


def torque(name: str) -> float:
    """A torque that suits the pair."""
    return TORQUE_PER_WIDTH * RIGS[name].driver.face_width


def mesh_halved() -> float:
    """Largest change of TE when the elements of both gears are halved."""
    worst = 0.0
    for name in RIGS:
        te = [static_cycle(law(name, n), PHASES, torque=[torque(name)]).transmission_error for n in (1, 2)]
        worst = max(worst, float(np.abs(te[0] / te[1] - 1).max()))
    return worst


def quadrilaterals() -> float:
    """Largest change of TE from quadrilaterals at twice the default size to those at the default size."""
    worst = 0.0
    for name in RIGS:
        laws = (law(name, n, "quadrilateral") for n in (0.5, 1))
        te = [static_cycle(one, PHASES, torque=[torque(name)]).transmission_error for one in laws]
        worst = max(worst, float(np.abs(te[0] / te[1] - 1).max()))
    return worst


def zones(name: str) -> list[tuple[float, float]]:
    """A span of phases well inside single, and one well inside double contact."""
    meshing: Pair = elastic_pair(RIGS[name])
    start, stop = ((rho - meshing.rho_pitch[0]) / meshing.base_pitch for rho in meshing.active_driver)
    # Contact runs from start to stop; single contact lies between stop - 1 and start + 1.
    margin = 0.12
    double = (start + margin, stop - 1 - margin)
    single = (stop - 1 + margin, start + 1 - margin)
    return [span for span in (single, double) if span[1] - span[0] > 0.05]


def ripple() -> float:
    """Second differences of TE over 400 positions inside a zone, over its range there."""
    worst = 0.0
    for name in RIGS:
        for low, high in zones(name):
            te = static_cycle(
                law(name), np.linspace(low, high, 400), torque=[torque(name)]
            ).transmission_error[0]
            worst = max(worst, float(np.abs(np.diff(te, 2)).max() / np.ptp(te)))
    return worst


def torque_ratio() -> float:
    """Departure of the torque ratio from z2/z1 where all contacts lie on the line of action."""
    worst = 0.0
    for name in RIGS:
        chosen = RIGS[name]
        phases = np.concatenate([np.linspace(low, high, 12) for low, high in zones(name)])
        cycle = static_cycle(law(name), phases, torque=[torque(name)])
        ratio = cycle.torque_driven / cycle.torque_driver
        worst = max(worst, float(np.abs(ratio * chosen.driver.teeth / chosen.driven.teeth - 1).max()))
    return worst


CHECKS = [
    Check("static-mesh-halved", "TE when the mesh is halved, 2 pairs", 2e-3, "", mesh_halved),
    Check("static-quadrilaterals", "TE when quadrilaterals are halved, 2 pairs", 2e-4, "", quadrilaterals),
    Check("static-ripple", "ripple of TE over 400 positions inside a zone, 2 pairs", 1e-3, "", ripple),
    Check("static-torque-ratio", "torque ratio on the line of action against z2/z1", 1e-6, "", torque_ratio),
]
