"""Is the driven gear held, or free, as the record declares? And are the inertias those that the gears move with?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import GEARS, Complexes, Look
from gearbench.records.seen.mesh_force import AGREE, EXPLAINED, NOTHING, Accounts, accounts_of

Array = NDArray[np.float64]

# Part of the force that accelerates a driven gear that is held.
HELD = 1e-3
# A balance that fits so well tells inertias, to OFF of themselves, where they do not stand for one another (smallest
# singular value) and the force depends on them.
EXACT, OFF, APART, MATTERS = 0.05, 0.1, 0.02, 0.02
# Factors that torques have over accelerations when one of them is in another unit, or the rate off by two, and how well
# such a factor must be met.
GAINS = {
    1e3: "torques in N mm",
    8.850746: "torques in lbf in",
    0.737562: "torques in lbf ft",
    4.0: "a sampling_rate of half the true one",
    0.25: "a sampling_rate of twice the true one",
    180 / np.pi: "angles in another unit",
}
MET = 0.02
# Accelerations that tell a factor are, with it, so many times what the forces disagree by after it.
TOLD = 3.0


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


def accelerations_as_torques(look: Look) -> list[Finding]:
    """Torques and accelerations balance as they are, not with all torques times one number: that number is a unit of
    torque, inertias, or the square of a rate. Of a driver alone a number above 1 may as well be a rotor beside it that
    is not in its inertia. Told by both gears, or, where these stand for one another, by each on a centre's support.

    The response is that many times too small if the torques have it. Where the number is known it is refused.
    """
    balance = _balance(look)
    if balance is not None and balance[1] >= OFF and (found := _of_another_unit(*balance)):
        return found
    balance = _on_supports(look)
    return [] if balance is None else _of_another_unit(*balance)


def _of_another_unit(found: Array, before: float, after: float) -> list[Finding]:
    """The finding where accelerations are so many times, `found`, the torques'; `before`, `after`: what the forces
    disagree by without and with that."""
    gain = float(found.mean())
    alike = min(found) > 0 and float(np.abs(found / gain - 1).max()) < OFF and (len(found) > 1 or gain < 1)
    if not alike or abs(gain - 1) <= OFF or after > EXACT or after > EXPLAINED * before:
        return []
    known = next((words for factor, words in GAINS.items() if abs(gain / factor - 1) < MET), None)
    hint = f": {known}?" if known else ": are the inertias or the unit of the torques right, and sampling_rate?"
    return [
        Finding(
            f"the torques are {gain:.4g} times what accelerations and inertias of the gears make (limit {1 + OFF:g};"
            f" the forces on the teeth disagree by {before:.2g} of their rms, without the factor by {after:.2g}){hint}",
            refused=known is not None,
            error=min(abs(1 / gain - 1), 1.0),
        )
    ]


def inertias_as_declared(look: Look) -> list[Finding]:
    """Both inertias are those with which torques and accelerations balance; silent where nothing balances.

    Least squares for the factors a, b of both inertias in T1/rb1 - a J1 theta1''/rb1 = T2/rb2 + b J2 theta2''/rb2.
    Where the driven gear is held its inertia shows nowhere, and the force needs none.
    """
    balance = _balance(look)
    if balance is None or look.record.attrs.get("driven_boundary") != "torque":
        return []
    found, before, after = balance
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


def _balance(look: Look) -> tuple[Array, float, float] | None:
    """Factors of the inertias, a alone or a, b, with which torques and accelerations balance (above), and by how much
    the forces at both gears disagree without and with these; None where nothing tells them."""
    accounts = accounts_of(look)
    if accounts is None or len(accounts.gears) < 2:
        return None
    first, second = accounts.gears["driver"], accounts.gears["driven"]
    moving = ["driver", "driven"] if look.record.attrs.get("driven_boundary") == "torque" else ["driver"]
    if any(f"{kind}_{gear}" not in accounts.gears[gear] for gear in moving for kind in ("torque", "angle")):
        return None
    if "torque_driven" not in second:
        return None
    columns = np.stack([sign * accounts.gears[g][f"angle_{g}"] for g, sign in zip(moving, (1, -1), strict=False)], 1)
    target = second["torque_driven"] - first["torque_driver"]
    scale = np.linalg.norm(columns, axis=0)
    if not (scale > 0).all():
        return None
    stacked = np.vstack([columns.real, columns.imag]) / scale
    found = np.linalg.lstsq(stacked, np.concatenate([target.real, target.imag]), rcond=None)[0] / scale
    if np.linalg.svd(stacked, compute_uv=False)[-1] < APART:
        # They stand for one another: one factor for both, unless these gears swing one against the other.
        whole = columns.sum(axis=1)
        if np.linalg.norm(whole) < APART * scale.max():
            return None
        found = np.full(len(moving), float(np.vdot(whole, target).real / np.vdot(whole, whole).real))
    fitted = {
        gear: {**accounts.gears[gear], f"angle_{gear}": factor * accounts.gears[gear][f"angle_{gear}"]}
        for gear, factor in zip(moving, found, strict=True)
    }
    if "driven" not in moving:
        fitted["driven"] = {"torque_driven": second["torque_driven"]}
    before, after = (
        float(Accounts(gears, {}, accounts.omega).misfit(GEARS)[0]) for gears in (accounts.gears, fitted)
    )
    parts = np.abs(found) * scale / max(float(np.linalg.norm(accounts.force("driver"))), NOTHING)
    told = float(parts.max()) > TOLD * after
    return (np.asarray(found), before, after) if told else None


def _on_supports(look: Look) -> tuple[Array, float, float] | None:
    """As `_balance`, with a factor of each gear: a in T / rb - a J theta'' / rb = -+ (k + c d/dt + m d^2/dt^2) y, the
    support's k, c, m unknown."""
    accounts = accounts_of(look)
    if accounts is None:
        return None
    factors, misfits = [], []
    for gear, parts in accounts.gears.items():
        if len(parts) < 2 or not accounts.centres:
            continue
        fits = [(accounts.balance(gear, centre), f"y_{centre}") for centre in accounts.centres]
        (factor, part, after), centre = min(fits, key=lambda fit: fit[0][2])
        if not part > TOLD * after:
            return None
        factors.append(factor)
        misfits.append((float(accounts.misfit((gear, centre))[0]), after))
    if not factors:
        return None
    before, after = min(misfits, key=lambda pair: pair[0] / max(pair[1], NOTHING))
    return np.array(factors), before, after


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
