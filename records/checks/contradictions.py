"""Channels that contradict one another in the mesh force: swapped, of another unit, reversed, late, dead."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.records.checks.devices import error_of_lag, far_side, late_device
from gearbench.records.checks.finding import Finding
from gearbench.records.checks.look import GEARS, Complexes, Look
from gearbench.records.checks.mesh_force import Accounts, accounts_of

Array = NDArray[np.float64]

# Accounts of the force agree when their misfit is below AGREE, and a suspicion is taken for true when under it they
# agree and misfit by EXPLAINED times less than without.
AGREE, EXPLAINED = 0.25, 1 / 3
# Factors that both torques may have, and the misfit that they cause at least.
FACTORS = {1e3: "1000 times too large"}
WRONG_UNIT = 0.5
# Delays that are looked for [samples], steps to the shortest period in the band, and the error that counts.
LONGEST, STEPS, MATTERS = 100, 8, 0.02
# A delay is believed when it leaves no more than EXACT, or FLOOR times the misfit of accounts without that channel:
# what lies between a torque and its gear, such as a soft coupling, looks like a delay in part only. Under noise the
# accounts that it repairs are left with what the others have, NOISE times at most, and were CLEARLY worse before.
EXACT, FLOOR = 0.06, 3.0
NOISE, CLEARLY = 1.5, 1 / 1.5
# A device with several channels is late, rather than one of them, where that leaves so much less.
BETTER = 0.5
# Misfit below which no delay is looked for.
SUSPICIOUS = 0.03
# Friction pushes the centres too, a little out of step.
SUSPICIOUS_Y = 0.15
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
    before, after = _worst(accounts), _worst(Accounts(other, accounts.centres, accounts.omega))
    if not _explains(before, after):
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
    before = _worst(accounts)
    for factor, words in FACTORS.items():
        scaled = {
            gear: {name: part / factor if name.startswith("torque_") else part for name, part in parts.items()}
            for gear, parts in accounts.gears.items()
        }
        after = _worst(Accounts(scaled, accounts.centres, accounts.omega))
        if before > WRONG_UNIT and after < EXACT:
            return [
                Finding(
                    f"the torques are {words} for the accelerations of gears of these inertias: the forces on the teeth"
                    f" contradict one another by {before:.2g} of their rms, then by {after:.2g} (limit {EXACT:g})"
                )
            ]
    return []


def clocks_agree(look: Look) -> list[Finding]:
    """No channel, and no device with several of them, lags behind the others: a delay does not make the mesh forces
    agree."""
    accounts = accounts_of(look)
    if accounts is None:
        return []
    top = float(accounts.omega[-1]) / (2 * pi)
    step = min(1 / (STEPS * top), 1 / look.rate)
    delays = np.arange(-np.ceil(LONGEST / look.rate / step), np.ceil(LONGEST / look.rate / step) + 1) * step
    turns: Complexes | None = None  # the same for every channel
    best: tuple[float, str, float] | None = None
    for name in _suspects(accounts, ("torque_", "angle_", "y_")):
        relations = [relation for relation in accounts.relations() if name in accounts.channels(relation)]
        misfits = [float(accounts.misfit(relation)[0]) for relation in relations]
        # A late y spoils both accounts with it alike: one that fits clears it. A late torque or angle shows between
        # the gears, and may hide in the damping that is fitted to a support.
        y = name.startswith("y_")
        now = min(misfits) if y else max(misfits)
        if now < (SUSPICIOUS_Y if y else SUSPICIOUS):
            continue

        turns = np.exp(1j * np.outer(delays, accounts.omega)) if turns is None else turns
        coarse = float(delays[int(np.argmin(_after(accounts, relations, name, turns)))])
        fine = coarse + step * np.linspace(-1.0, 1.0, 41)
        found = _after(accounts, relations, name, np.exp(1j * np.outer(fine, accounts.omega)))
        after, delay = float(found.min()), float(fine[int(np.argmin(found))])
        others = [relation for relation in accounts.relations() if relation not in relations]
        floor = max((float(accounts.misfit(relation)[0]) for relation in others), default=0.0)
        # Accounts that disagree as much without the channel do not say that it is late: bodies that twist do that.
        if floor > CLEARLY * now:
            continue
        clean = after < max(EXACT, FLOOR * floor) and _explains(now, after)
        noisy = after < NOISE * floor and after < CLEARLY * now
        if (clean or noisy) and (best is None or after < best[0]):
            best = (after, name, delay)
    device = late_device(accounts, delays)
    device = far_side(look, accounts) if device is None and best is None else device
    if device is not None and (best is None or device[0] < BETTER * best[0]):
        return _late(look, f"the {device[1]} ({', '.join(sorted(device[2]))})", device[2], device[3])
    return [] if best is None else _late(look, best[1], frozenset([best[1]]), best[2])


def _late(look: Look, what: str, names: frozenset[str], delay: float) -> list[Finding]:
    """The finding of channels that are late by `delay` [s], if that matters."""
    error = error_of_lag(look, names, delay)
    if error < MATTERS and abs(delay) < 0.1 / look.rate:
        return []
    words = ("lag behind" if delay > 0 else "lead") if len(names) > 1 else ("lags behind" if delay > 0 else "leads")
    late = 1e6 * abs(delay)
    size = f"{late:.4g}" if late < 1e4 else f"{late:.0f}"
    return [
        Finding(
            f"{what} {words} the other channels by {size} us ({abs(delay) * look.rate:.3g} samples),"
            " which the balance of forces at the gears shows (delay_s of a channel map takes it off); it costs about"
            f" {error:.0%} of the response",
            refused=False,
            error=error,
        )
    ]


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


def _worst(accounts: Accounts) -> float:
    return max(float(accounts.misfit(relation)[0]) for relation in accounts.relations())


def _after(accounts: Accounts, relations: list[tuple[str, str]], name: str, turns: Complexes) -> Array:
    """The worst misfit (D,) of the relations once a channel is turned."""
    own = frozenset([name])
    return np.asarray(np.max([accounts.misfit(relation, own, turns) for relation in relations], axis=0))


def _suspects(accounts: Accounts, kinds: tuple[str, ...]) -> list[str]:
    names = set().union(*(accounts.channels(relation) for relation in accounts.relations()))
    return sorted(name for name in names if name.startswith(kinds))


def _explains(before: float, after: float) -> bool:
    return after < AGREE and after < EXPLAINED * before
