"""Stored dte and force against the channels of the same file; sizes that no gear has; dead channels."""

from __future__ import annotations

from math import cos, pi, radians
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import GEARS, Look

Array = NDArray[np.float64]

# Rms difference of what is stored from what the channels give, relative to the larger one's fluctuation ...
STORED = 0.2
# ... of the means, relative to the larger of both and the fluctuation; and a factor between both that is said.
STORED_MEAN = 0.2
FACTOR = 0.02
# Response of the DTE to the force at excited lines [m/N], as an rms ratio: no gear train is as soft as 1e4 N/m, ...
SOFTEST = 1e-4
# ... no mesh stiffer than 50 N/(um mm) (ISO 6336-1 has 20 for steel) on a face WIDEST modules wide; above its
# resonances a rig answers by its mass, up to a thousand times less.
STIFFEST, WIDEST, BY_MASS = 50e9, 40.0, 1e-3
# Lines at the low end of the excitation that may show a spring: fewest, and part of all; part of their rms that is
# alike, and of that in phase with the force. Springs below are no mesh of metal's, unless on very soft supports [N/m].
LOW_LINES, LOW_PART, ALIKE, SOFT = 6, 0.04, 0.8, 2e6
# Departure from whole mesh cycles from which on a line is none of the operating response's.
WHOLE = 1e-6
# A DTE that swings by more than this part of the module is no mesh's, and neither is a gear centre that does.
OF_MODULE = 1.0
# Where teeth or base radii are not known: the largest swing [m].
LARGEST_SWING = 0.02
# Below this part of what is subtracted, a DTE is rounding.
ROUNDING = 1e-13


def stored_as_channels_have_it(look: Look) -> list[Finding]:
    """Stored dte and force are those that angles, displacements and torques of the file give.

    Without y channels the angles give another dte, and without inertias or behind a coupling the torques give no
    force: then nothing is said.
    """
    found = []
    names: tuple[Literal["dte", "force"], ...] = ("dte", "force")
    for name in names:
        stored, computed = look.channel(name), look.dte if name == "dte" else look.force
        if name == "force" and stored is not None and _is_driver_torque(look, stored):
            continue
        sources = ("angle_driver", "angle_driven", "y_driver", "y_driven") if name == "dte" else ("torque_driver",)
        if stored is None or computed is None or any(source not in look.record for source in sources):
            continue
        swing = max(float(stored.std()), float(computed.std()))
        apart = float((stored - computed).std())
        means = float(stored.mean()), float(computed.mean())
        level = max(abs(means[0]), abs(means[1]), swing)
        compare_means = name == "force" or look.zero_known
        if apart <= STORED * swing and not (compare_means and abs(means[0] - means[1]) > STORED_MEAN * level):
            found += _factor_between(name, stored, computed, ", ".join(sources))
            continue
        unit = "m" if name == "dte" else "N"
        found.append(
            Finding(
                f"the stored {name} (mean {means[0]:.4g} {unit}, rms fluctuation {stored.std():.4g} {unit}) contradicts"
                f" {', '.join(sources)} of the same record, which give mean {means[1]:.4g} {unit} and"
                f" {computed.std():.4g} {unit} (limit {STORED:.0%})"
            )
        )
    return found


def _factor_between(name: str, stored: Array, computed: Array, sources: str) -> list[Finding]:
    """A factor between two signals that the noise of neither makes: both regressions lie on one side of 1."""
    one, two = stored - stored.mean(), computed - computed.mean()
    cross = float(one @ two)
    if not cross > 0.0:
        return []
    factors = sorted((cross / float(two @ two), float(one @ one) / cross))
    off = factors[0] - 1 if factors[0] > 1 else factors[1] - 1
    if factors[0] <= 1 <= factors[1] or abs(off) <= FACTOR:
        return []
    return [
        Finding(
            f"the stored {name} is {1 + off:.3g} times what {sources} of the same record give (limit {FACTOR:.0%}):"
            " one of them has another gain",
            refused=False,
            error=abs(off),
        )
    ]


def dte_alive(look: Look) -> list[Finding]:
    """A DTE that does not change is a dead channel, or one channel stored under two names."""
    found = []
    for values, name in ((look.channel("dte"), "dte"), (look.dte, "the dte of angles and displacements")):
        if values is None:
            continue
        largest = float(np.abs(values).max())
        angle, radius = look.channel("angle_driver"), look.number("base_radius_driver")
        if name != "dte" and angle is not None and radius is not None:
            largest = max(largest, float(np.abs(angle).max()) * radius)
        if float(np.ptp(values)) <= ROUNDING * largest:
            found.append(Finding(f"{name} is constant ({values[0]:.4g} m): gears in mesh are never without motion"))
            break
    return found


def centres_alive(look: Look) -> list[Finding]:
    """A displacement that does not change is a dead sensor; its part of the DTE is missing.

    The error is what the other gear's displacement contributes to the DTE: mesh forces are opposite and supports of
    one rig alike.
    """
    found = []
    for gear, other in (GEARS, GEARS[::-1]):
        values, beside = look.channel(f"y_{gear}"), look.channel(f"y_{other}")
        if values is None or np.ptp(values) > 0.0:
            continue
        size = 0.0 if look.dte is None else float(look.dte.std())
        error = float(beside.std()) / size if beside is not None and size > 0 else 0.0
        found.append(
            Finding(
                f"y_{gear} is constant ({values[0]:.4g} m): a dead sensor or a rigid support; the dte lacks its part",
                refused=False,
                error=min(error, 1.0),
            )
        )
    return found


def swings_fit_the_teeth(look: Look) -> list[Finding]:
    """DTE and displacements stay within the size of a tooth."""
    most, limit = _largest_swing(look)
    found = []
    length = "is it in mm or um?"
    for name, values, hint in (
        ("y_driver", look.channel("y_driver"), length),
        ("y_driven", look.channel("y_driven"), length),
        ("dte", look.channel("dte"), length),
        ("the dte of angles and displacements", None if "dte" in look.record else look.dte, "are the angles in rad?"),
    ):
        if values is not None and float(np.ptp(values)) > most:
            found.append(Finding(f"{name} swings by {np.ptp(values):.4g} m (limit {most:.3g} m, {limit}): {hint}"))
    stored = look.channel("dte")
    if not found and stored is not None and "angle_driver" not in look.record and abs(float(stored.mean())) > most:
        found.append(
            Finding(
                f"dte has a mean of {stored.mean():.4g} m (limit {most:.3g} m, {limit}): {length} Where its zero is"
                " arbitrary, take the mean off"
            )
        )
    return found[:1]


def response_is_a_gears(look: Look) -> list[Finding]:
    """DTE over force at the excited lines lies within what any mesh on any support does."""
    error, force = look.stored_or_own_dte, look.force
    if error is None or force is None or float(np.ptp(force)) <= 1e-9 * float(np.abs(force).max()):
        return []
    driving = look.spectrum(force)
    lines = look.excited(force)
    swing = float(np.linalg.norm(look.spectrum(error)[lines]))
    # A constant dte is said elsewhere.
    if not lines.any() or swing <= 1e-9 * float(np.abs(error).max()):
        return []
    ratio = swing / float(np.linalg.norm(driving[lines]))
    module = _module(look)
    least = BY_MASS / (STIFFEST * WIDEST * (module or LARGEST_SWING))
    if least <= ratio <= SOFTEST:
        return []
    hint = "is the dte in mm or um?" if ratio > SOFTEST else "is a torque in N mm?"
    return [
        Finding(
            f"at the excited lines the dte is {ratio:.3g} m/N of the force; gears of this size lie between {least:.2g}"
            f" and {SOFTEST:g} m/N: {hint}"
        )
    ]


def spring_is_a_mesh(look: Look) -> list[Finding]:
    """Where the dte follows the lowest excited lines as a spring does, that spring is no stiffer than a mesh, and
    hardly softer than SOFT. For records without angles, which know the unit of their dte by nothing else."""
    error, force = look.stored_or_own_dte, look.force
    if error is None or force is None or "angle_driver" in look.record or not np.ptp(force) > 0:
        return []
    lines = look.excited(force)
    lines &= np.cumsum(lines) <= max(LOW_LINES, LOW_PART * np.count_nonzero(lines))
    if np.count_nonzero(lines) < LOW_LINES:
        return []
    driving, response = look.spectrum(force)[lines], look.spectrum(error)[lines]
    if look.mesh_period is not None:
        cycles = look.omega[lines] * look.mesh_period / (2 * pi)
        between = np.abs(cycles - np.round(cycles)) > WHOLE
        driving, response = driving[between], response[between]
    each = response * driving.conj() / np.maximum(np.abs(driving) ** 2, np.finfo(float).tiny)
    if each.size < LOW_LINES or abs(each.mean()) < ALIKE * float(np.sqrt(np.mean(np.abs(each) ** 2))):
        return []  # noise, sidebands or a resonance
    compliance = complex(each.mean())
    if compliance.real < ALIKE * abs(compliance):
        return []
    stiffness, face = 1 / compliance.real, WIDEST * (_module(look) or LARGEST_SWING)
    if stiffness > STIFFEST * face:
        return [
            Finding(
                f"at the lowest excited lines the dte follows the force like a spring of {stiffness:.2g} N/m; the"
                f" stiffest mesh, of a face {face:.2g} m wide, has {STIFFEST * face:.2g} N/m: is the dte divided by"
                " 1000 once too often, or the force in mN?"
            )
        ]
    if stiffness < SOFT:
        return [
            Finding(
                f"at the lowest excited lines the dte follows the force like a spring of {stiffness:.2g} N/m, softer"
                f" than meshes of metal on their supports ({SOFT:g} N/m): is the dte in mm, or the force in kN?",
                refused=False,
                error=1.0,  # a unit; gears of plastic may be so soft
            )
        ]
    return []


def _is_driver_torque(look: Look, stored: Array) -> bool:
    """Whether a stored force is T1 / rb1, which it also is where the load answers the driver's torque at any time."""
    torque, radius = look.channel("torque_driver"), look.number("base_radius_driver")
    if torque is None or radius is None:
        return False
    return bool(np.sqrt(np.mean((stored - torque / radius) ** 2)) <= ROUNDING**0.5 * np.abs(stored).max())


def _largest_swing(look: Look) -> tuple[float, str]:
    module = _module(look)
    return (OF_MODULE * module, "the module") if module else (LARGEST_SWING, "the largest common module")


def _module(look: Look) -> float | None:
    """Module [m] of a gear cut at 20 degrees, None where the record does not say."""
    teeth, radius = look.number("teeth_driver"), look.number("base_radius_driver")
    return 2 * radius / (teeth * cos(radians(20.0))) if teeth and radius else None
