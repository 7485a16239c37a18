"""Is the driven gear held, or free, as the record declares? And are the inertias those that the gears move with?"""

from __future__ import annotations

import numpy as np

from gearbench.records.checks.finding import Finding
from gearbench.records.checks.look import GEARS, Complexes, Look
from gearbench.records.checks.mesh_force import Accounts, accounts_of

# Both accounts of the force agree below AGREE; what explains a disagreement leaves EXPLAINED of it at most.
AGREE, EXPLAINED = 0.25, 1 / 3
# Part of the force that accelerates a driven gear that is held.
HELD = 1e-3
# A balance that fits so well tells inertias, to OFF of themselves, where they do not stand for one another (smallest
# singular value) and the force depends on them.
EXACT, OFF, APART, MATTERS = 0.05, 0.1, 0.02, 0.02


def boundary_as_declared(look: Look) -> list[Finding]:
    """driven_boundary "speed": the driven gear turns steadily, so that F = T1 / rb1; "torque": it takes part.

    Told by which of both balances with the other gear: T2 / rb2 alone, or with J2 theta2'' / rb2. The error is the
    difference of both forces relative to the right one.
    """
    accounts = accounts_of(look)
    declared = look.record.attrs.get("driven_boundary")
    forces = _forces(look)
    if accounts is None or len(accounts.gears) < 2 or "angle_driven" not in accounts.gears["driven"] or forces is None:
        return []
    driven = accounts.gears["driven"]
    held = Accounts({**accounts.gears, "driven": {"torque_driven": driven["torque_driven"]}}, {}, accounts.omega)
    free, steady = float(accounts.misfit(GEARS)[0]), float(held.misfit(GEARS)[0])
    moved = float(np.linalg.norm(driven["angle_driven"]) / np.linalg.norm(accounts.force("driver")))
    swings = free < AGREE and free < EXPLAINED * steady
    rests = steady < AGREE and (steady < EXPLAINED * free or moved < HELD)
    size = {kind: float(np.linalg.norm(force)) for kind, force in forces.items()}
    apart = float(np.linalg.norm(forces["free"] - forces["held"]))
    if declared == "speed" and swings and not rests:
        error = apart / size["free"]
        words = "the driven gear takes part in the motion, so that T1 / rb1 is not the force on the mesh"
    elif declared == "torque" and rests and not swings:
        error = apart / size["held"]
        words = "the driven gear turns as steadily as if it were held, so that its inertia takes no part"
    else:
        return []
    return [
        Finding(
            f'driven_boundary = "{declared}", but {words}: the forces at both gears disagree by'
            f" {steady if declared == 'speed' else free:.2g} of their rms with it and by"
            f" {free if declared == 'speed' else steady:.2g} without (limit {AGREE:g})",
            refused=False,
            error=min(error, 1.0),
        )
    ]


def inertias_as_declared(look: Look) -> list[Finding]:
    """Both inertias are those with which torques and accelerations balance; silent where nothing balances.

    Least squares for the factors a, b of both inertias in T1/rb1 - a J1 theta1''/rb1 = T2/rb2 + b J2 theta2''/rb2.
    Where the driven gear is held its inertia shows nowhere, and the force needs none.
    """
    accounts = accounts_of(look)
    if accounts is None or len(accounts.gears) < 2 or look.record.attrs.get("driven_boundary") != "torque":
        return []
    first, second = accounts.gears["driver"], accounts.gears["driven"]
    before = float(accounts.misfit(GEARS)[0])
    if not {"angle_driver", "torque_driver"} <= set(first) or not {"angle_driven", "torque_driven"} <= set(second):
        return []
    columns = np.stack([first["angle_driver"], -second["angle_driven"]], axis=1)
    target = second["torque_driven"] - first["torque_driver"]
    scale = np.linalg.norm(columns, axis=0)
    if not (scale > 0).all():
        return []
    stacked = np.vstack([columns.real, columns.imag]) / scale
    if np.linalg.svd(stacked, compute_uv=False)[-1] < APART:
        return []
    found = np.linalg.lstsq(stacked, np.concatenate([target.real, target.imag]), rcond=None)[0] / scale
    fitted = Accounts(
        {
            "driver": {**first, "angle_driver": found[0] * first["angle_driver"]},
            "driven": {**second, "angle_driven": found[1] * second["angle_driven"]},
        },
        {},
        accounts.omega,
    )
    after = float(fitted.misfit(GEARS)[0])
    off = {gear: float(factor) for gear, factor in zip(GEARS, found, strict=True) if abs(factor - 1) > OFF}
    if not off or min(found) <= 0 or after > EXACT or after > EXPLAINED * before:
        return []
    forces, better = _forces(look), _forces(look, (float(found[0]), float(found[1])))
    assert forces is not None and better is not None
    error = float(np.linalg.norm(forces["free"] - better["free"]) / np.linalg.norm(better["free"]))
    if error < MATTERS:
        return []
    declared = {gear: look.number(f"inertia_{gear}") or 0.0 for gear in off}
    names = " and ".join(f"inertia_{gear} = {declared[gear]:.4g}" for gear in off)
    wanted = " and ".join(f"{factor * declared[gear]:.4g}" for gear, factor in off.items())
    return [
        Finding(
            f"{names} kg m^2, but torques and accelerations balance with {wanted} kg m^2 (the forces at both gears"
            f" disagree by {before:.2g} of their rms, then by {after:.2g}; limit {EXACT:g})",
            refused=False,
            error=min(error, 1.0),
        )
    ]


def _forces(look: Look, factors: tuple[float, float] = (1.0, 1.0)) -> dict[str, Complexes] | None:
    """Force on the mesh (lines,) [N] if the driven gear is held, and if it is free, with inertias times `factors`."""
    radii, inertias = ([look.number(f"{name}_{gear}") for gear in GEARS] for name in ("base_radius", "inertia"))
    torques = [look.channel(f"torque_{gear}") for gear in GEARS]
    if None in radii or None in inertias or torques[0] is None or torques[1] is None:
        return None
    r1, r2 = (float(radius or 0) for radius in radii)
    j1, j2 = (factor * float(inertia or 0) for factor, inertia in zip(factors, inertias, strict=True))
    t1, t2 = look.spectrum(torques[0]), look.spectrum(torques[1])
    mass = j1 * j2 / (j1 * r2**2 + j2 * r1**2)
    return {"held": t1 / r1, "free": mass * (r1 * t1 / j1 + r2 * t2 / j2)}
