"""A torque that shakes a rig feeds it: no rig gives back what it was never given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearbench.records.checks.contradictions import accounts_agree
from gearbench.records.clocks.late import clocks_agree
from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import GEARS, Look

# Cosine between force and rate of the transmission error over the excited lines. At the gears themselves a passive rig
# has it at 0 or above; the gear centres, on which the force does not work, may bring dte a little below.
LIMIT = -0.1
# Part of the excited lines, the lowest, in which a channel that is late still moves with the torque: it turns the
# highest ones first, a sign all of them.
LOW = 1 / 3
# Longest delay of an angle [shortest excited periods] that may explain a mean and lines that oppose the torque, and how
# much longer it may be than what brings the mean to zero: the deflection under the mean torque is there too.
TURNED, BEYOND = 1 / 3, 1.5


def force_feeds_the_rig(look: Look) -> list[Finding]:
    """The excitation does positive work on the transmission error: mean of F d/dt over the excited lines >= 0.

    Behind a soft coupling the torque of the drive may well work against the gear. So a negative cosine counts where the
    balance of both gears says that the torques are theirs, or where the means are opposed too, by more than the dte
    fluctuates: flanks that part have their mean anywhere in the backlash. Where the zero of the dte is arbitrary it is
    only said, and so it is where the lowest lines move with the torque: a delay is no contradiction, and one that is
    found elsewhere explains it.
    """
    force = look.force
    if force is None or float(np.ptp(force)) <= 1e-9 * float(np.abs(force).max()):
        return []
    rolled = _rolled(look)
    error, name = (rolled, "angles") if rolled is not None else (look.channel("dte"), "dte")
    cosine = 0.0 if error is None else _cosine(look, force, error)
    if error is None or cosine >= LIMIT or clocks_agree(look):
        return []
    # Gears that yield across their supports leave a dte without that motion, whose mean may have any sign.
    whole = rolled if rolled is not None else look.stored_or_own_dte
    opposed = whole is not None and look.zero_known and -float(whole.mean()) * np.sign(force.mean()) > whole.std()
    certain = opposed or accounts_agree(look)
    if not certain and (look.zero_known or name == "angles"):
        return []
    low = _cosine(look, force, error, LOW)
    moves = f"the {name} move against the torque that shakes them"
    delay = _late_angle(look, force, rolled) if rolled is not None and opposed else 0.0
    if delay > 0.0:
        words = (
            f"{moves}, in the mean too: the cosine between force and rate is {cosine:.2f} (limit {LIMIT:g}); the"
            f" driver's angle late by {1e6 * delay:.3g} us or more, or the driven gear's early, explains both: are they"
            " of two devices?"
        )
        return [Finding(words, refused=False, error=1.0)]
    if certain and low > 0.0:
        words = (
            f"{moves} at the upper excited lines, at the lower ones with it: the cosine between force and rate is"
            f" {cosine:.2f} (limit {LIMIT:g}), {low:.2f} in the lowest third: is a channel shifted in time?"
        )
        return [Finding(words, refused=False, error=1.0)]
    words = (
        f"{moves}: the cosine between force and rate is {cosine:.2f} (limit {LIMIT:g}), as if the rig fed the drive:"
        " are driver and driven swapped, is a sign reversed, or a channel shifted in time?"
    )
    return [Finding(words, refused=certain, error=0.0 if certain else 1.0)]


def _cosine(look: Look, force: NDArray[np.float64], error: NDArray[np.float64], part: float = 1.0) -> float:
    """That of force and rate of an error over the excited lines, or a part of these, the lowest."""
    driving = look.spectrum(force)
    lines = np.flatnonzero(look.excited(force))
    lines = lines[: max(int(np.ceil(part * lines.size)), 1)]
    driving, rate = driving[lines], look.spectrum(error, derivative=1)[lines]
    size = float(np.linalg.norm(driving) * np.linalg.norm(rate))
    return float(np.vdot(driving, rate).real) / size if size > 0 else 0.0


def _late_angle(look: Look, force: NDArray[np.float64], rolled: NDArray[np.float64]) -> float:
    """By how much [s] the driver's angle must lag at least for a mean of rb1 theta1 - rb2 theta2 that opposes the
    torque, 0 where the lines of a record of that delay would still move against the torque, or none so short would do.

    A gear that turns gets ahead of an angle that is late, by its speed times the delay; a reversed sign or an exchange
    of channels takes no more than the deflection, a delay far too short to turn the lines.
    """
    radius, omega = look.number("base_radius_driver"), 2 * np.pi * np.fft.rfftfreq(look.samples, 1 / look.rate)
    angle, speed = look.channel("angle_driver"), look.speed("driver")
    if radius is None or angle is None or not speed > 0:
        return 0.0
    least = -float(rolled.mean()) * float(np.sign(force.mean())) / (radius * speed)
    if not 0.0 < least * look.omega[look.excited(force)][-1] / (2 * np.pi) < TURNED:
        return 0.0
    swing = np.fft.rfft(angle - speed * np.arange(angle.size) / look.rate)
    for delay in least * np.linspace(1.0, BEYOND, 6):
        ahead = radius * np.fft.irfft(swing * np.expm1(1j * omega * delay), angle.size)
        if min(_cosine(look, force, rolled + ahead, part) for part in (1.0, LOW)) >= LIMIT:
            return float(least)
    return 0.0


def _rolled(look: Look) -> NDArray[np.float64] | None:
    """rb1 theta1 - rb2 theta2 (samples,) [m]."""
    angles = [look.channel(f"angle_{gear}") for gear in GEARS]
    radii = [look.number(f"base_radius_{gear}") for gear in GEARS]
    if angles[0] is None or angles[1] is None or radii[0] is None or radii[1] is None:
        return None
    return np.asarray(radii[0] * angles[0] - radii[1] * angles[1])
