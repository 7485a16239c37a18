"""Channels that contradict one another in the mesh force: swapped, of another unit, reversed, dead."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import GEARS, Look
from gearbench.records.seen.mesh_force import AGREE, Accounts, accounts_of, explains

Array = NDArray[np.float64]

# Factors that both torques may have, and the misfit that they cause at least.
FACTORS = {1e3: "1000 times too large"}
WRONG_UNIT = 0.5
# What explains a disagreement of units leaves no more than this.
EXACT = 0.06
# Mass of a gear from the motion of its centre, over J / rb^2 of its rotation: 0.2 to 4 for gears, less with flywheels.
MASS = (1 / 200, 200.0)
# The same beyond which a flywheel or a heavy housing is one explanation and inches for metres, or torques in lbf in,
# are another.
USUAL = (1 / 25, 25.0)
# Parts of the force's rms by which stiffness, damping or mass must show to be taken at their word.
SHOWS = 0.3


def gears_not_swapped(look: Look) -> list[Finding]:
    """The driver's inertia takes from its torque, the driven gear's adds to it; swapped, it is the other way round."""
    accounts = accounts_of(look)
    if accounts is None or len(accounts.gears) < 2:
        return []
    other = {
        gear: {name: -part if name.startswith("angle_") else part for name, part in parts.items()}
        for gear, parts in accounts.gears.items()
    }
    before, after = accounts.worst, Accounts(other, accounts.centres, accounts.omega).worst
    if not explains(before, after):
        return []
    return [
        Finding(
            "driver and driven are swapped: torques and angular accelerations balance only if the driven gear is taken"
            f" to drive (misfit of the two forces on the teeth {before:.2g}, then {after:.2g}; limit {AGREE:g})"
        )
    ]


def torques_fit_inertias(look: Look) -> list[Finding]:
    """Torques and accelerations of both gears are of one unit: m_e theta'' is a force, not a thousandth of it."""
    accounts = accounts_of(look)
    if accounts is None or len(accounts.gears) < 2:
        return []
    before = accounts.worst
    for factor, words in FACTORS.items():
        scaled = {
            gear: {name: part / factor if name.startswith("torque_") else part for name, part in parts.items()}
            for gear, parts in accounts.gears.items()
        }
        after = Accounts(scaled, accounts.centres, accounts.omega).worst
        if before > WRONG_UNIT and after < EXACT:
            return [
                Finding(
                    f"the torques are {words} for the accelerations of gears of these inertias: the forces on the teeth"
                    f" contradict one another by {before:.2g} of their rms, then by {after:.2g} (limit {EXACT:g})"
                )
            ]
    return []


def displacements_fit(look: Look) -> list[Finding]:
    """Mesh force over displacement is a support: springs, dampers and masses are positive, the mass is a gear's."""
    accounts = accounts_of(look)
    if accounts is None:
        return []
    found = []
    for centre in accounts.centres:
        fits = [accounts.support(gear, centre) for gear in accounts.gears]
        values, parts, left = min(fits, key=lambda fit: fit[2])
        if left > AGREE:
            continue
        largest = int(np.argmax(parts))
        if values[largest] < 0 and all(values[parts > SHOWS] < 0):
            found.append(
                Finding(
                    f"y_{centre} moves against the force of the teeth (support stiffness {values[0]:.3g} N/m, damping"
                    f" {values[1]:.3g} N s/m, mass {values[2]:.3g} kg; all must be positive): is the sensor the wrong"
                    " way round? y is positive along the pitch-point velocity"
                )
            )
            continue
        radius, inertia = look.number(f"base_radius_{centre}"), look.number(f"inertia_{centre}")
        if radius is None or inertia is None or parts[2] < max(5 * left / np.sqrt(accounts.omega.size), 1e-3):
            continue
        ratio = float(values[2]) * radius**2 / inertia
        if ratio <= 0 or USUAL[0] <= ratio <= USUAL[1]:
            continue
        possible = MASS[0] <= ratio <= MASS[1]
        if possible and (left > EXACT or not accounts_agree(look)):  # a late or a dead channel fits as badly
            continue
        hint = "a flywheel, or is" if possible else "is"
        units = "inches, are torques in lbf in?" if possible else "mm or um, or are torques in N mm?"
        found.append(
            Finding(
                f"y_{centre} moves under the force of the teeth like a gear of {values[2]:.3g} kg, but its inertia is"
                f" that of {inertia / radius**2:.3g} kg at the base radius (limit a factor"
                f" {USUAL[1] if possible else MASS[1]:g}): {hint} y_{centre} in {units}",
                refused=not possible,
                error=min(look.part_of_dte(f"y_{centre}"), 1.0) if possible else 0.0,
            )
        )
    return found


def load_torque_alive(look: Look) -> list[Finding]:
    """A torque that stays constant while the other one swings and both gears turn freely is a dead channel, unless the
    gears' accelerations confirm it."""
    if look.record.attrs.get("driven_boundary") != "torque":
        return []
    torque = {gear: look.channel(f"torque_{gear}") for gear in ("driver", "driven")}
    swings = {gear: 0.0 if values is None else float(np.ptp(values)) for gear, values in torque.items()}
    dead = [gear for gear in torque if swings[gear] <= 1e-9 * max(swings.values())]
    if len(dead) != 1:
        return []
    if accounts_agree(look):
        return []
    return [
        Finding(
            f"torque_{dead[0]} is constant, while the other torque swings by {max(swings.values()):.3g} N m and both"
            " gears turn freely: a dead channel, or a load that does not answer; the accelerations of the gears do not"
            " confirm it",
            refused=False,
            error=1.0,
        )
    ]


def accounts_agree(look: Look) -> bool:
    """Whether both gears give one force on the teeth, so that the torques are those at the gears."""
    accounts = accounts_of(look)
    return accounts is not None and len(accounts.gears) == 2 and float(accounts.misfit(GEARS)[0]) < AGREE
