"""A housing on which the displacement sensors stand: they see none of its motion, so that nothing but the transmission
error shows where it resonates.

What a motion of little compliance adds to a line is to first order of the form in `hidden_motion`. So ten simulations
of stiff ones tell E, and any resonance follows without a simulation: many are compared on the excited lines.
"""

from __future__ import annotations

from collections.abc import Callable
from math import log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.fitting.fit import Optimum, Sensitivity, fit_afresh, gone_on, sensitivity_of
from gearbench.diagnosis.fitting.hidden_motion import Motion, Resonance, answer_of, likeliest, products_of
from gearbench.diagnosis.fitting.rotation import but_rotation, with_rotation
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.intake.signals import frequencies
from gearbench.diagnosis.simulation.quadratic import real_parts
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.simulation.target import Target
from gearbench.diagnosis.structure.structure import (
    ACROSS,
    ACROSS_BEGIN,
    EQUAL,
    HOUSING,
    HOUSING_RATIO,
    HOUSING_SD,
    MODE,
    MOTIONS,
    NONE,
    OBLIQUE,
    SEAT,
    SHAPE,
    STIFFEST,
    pace_of,
    seated,
)

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

# Of the motions that tell E: logarithm of their frequency over the supports', and their compliance.
STIFF_AT, STIFF = 1.8, 0.01
RENEWALS = 3
BEGUN = 1, 3  # frequencies at which a first and a second motion are begun: beside another it is seen less well
SHOWS = 0.01  # compliance from which a second one does
# Nats of the excited lines, to first order, by which a second one is plain to see beside a first that fell behind.
PLAIN = 10.0
# Shares of driver and driven along, then across: ten whose products with themselves tell those of any.
TOLD_BY = np.array([
    (1, 0, 0, 0), (0, 1, 0, 0), (1, 1, 0, 0), (1, 0, 1, 0), (1, 0, -1, 0),
    (1, 0, 0, 1), (1, 0, 0, -1), (0, 1, 1, 0), (0, 1, 0, 1), (1, 0, 1, 1),
], dtype=float)  # fmt: skip


def on_a_housing(
    simulator: Simulator, found: Optimum, first: Motion | None = None, tell: Callable[[], None] = lambda: None
) -> Optimum | None:
    """The fit with sensors on a housing, one motion of it after the other as long as it comes closer by each, which is
    told; `first`: its first motion, if that is known. None where a rig has none, or the excited lines know of none."""
    unknowns = simulator.layout.unknowns
    p, best = without_housing(simulator, found.p), None
    if p is None:
        return None
    tell()
    free = ~unknowns.of((HOUSING,)) & but_rotation(unknowns, found.sd)
    for number in range(len(MOTIONS)):
        # One whose resonance is not looked for yet would grow at another's meanwhile.
        free[unknowns[HOUSING].start + number] = True
        if number == 0 and first is not None:
            begun = [with_hidden(unknowns, p, number, first)]
        else:
            seen = with_hidden_motions(simulator, p, found.sd, number)
            if best is not None and best.cost - best.left > found.cost:
                # Beside one of two motions of equal size much is left of every line, and one more may catch up.
                seen = [one for one in seen[:1] if one[0] > PLAIN]
            begun = [one for _, one in seen]
        tried = [fit_afresh(simulator, one, found.sd, renewals=RENEWALS, chosen=free) for one in begun]
        again = max((one for one in tried if one is not None), key=lambda one: one.evidence, default=None)
        if again is None or (best is not None and again.evidence <= best.evidence):
            break
        p, best = again.p, again
    whole = with_rotation(simulator, found, best) if best else None
    return gone_on(simulator, whole, RENEWALS) if whole and whole.evidence > found.evidence else whole


def without_housing(simulator: Simulator, p: Array) -> Array | None:
    """`p` (size,) without a housing, its sensors where they would stand on one, with supports that yield across; None
    where a rig has none to find, as one whose case gives it."""
    unknowns = simulator.layout.unknowns
    if HOUSING not in unknowns.slices:
        return None
    plain, soft = seated(unknowns, p), p[unknowns[ACROSS]]
    plain[unknowns[HOUSING]], plain[unknowns[OBLIQUE]] = 0.0, 0.0
    plain[unknowns[ACROSS]] = np.where(soft > STIFFEST, soft, ACROSS_BEGIN)
    return plain


def with_hidden_motions(simulator: Simulator, p: Array, sd: Array, number: int) -> list[tuple[float, Array]]:
    """By how many nats that motion of a housing its sensors stand on explains the excited lines, and `p` (size,) with
    it, where its resonance does so best under the prior `sd` (size,), and, of a second one, without shares across there
    and where it does so next; none where no line is excited, or no such rig can be."""
    whole, unknowns = simulator.target, simulator.layout.unknowns
    if not whole.excited.any():
        return []
    excited = simulator.of_target(whole.of_lines(whole.excited[whole.of_line]))
    over = _over(excited)
    try:
        told = _told(excited, p, number, over)
        sensitivity = sensitivity_of(excited, p, sd, but_rotation(unknowns, sd))
    except ValueError:
        return []
    if told is None or sensitivity is None:
        return []
    begun = _likeliest(excited, p, sd, told, sensitivity, over, most=BEGUN[number])
    if number > 0:
        # Beside another its shares across are told badly, and a fit lets stand what a rig hardly feels.
        plain = [
            (gain, Motion(one.resonance, one.shares * (1, 1, 0, 0), max(one.compliance, SHOWS))) for gain, one in begun
        ]
        begun = [*begun[:1], *plain]
    return [(gain, with_hidden(unknowns, p, number, one)) for gain, one in begun]


def _told(excited: Simulator, p: Array, number: int, over: Array) -> Complex | None:
    """E (10, K) of the lines of a simulator, at frequencies `over` those of the supports (K,), by PAIRS of shares of
    that motion; None where a rig cannot be."""
    here, stiff, unknowns = excited.lines(p), Resonance(STIFF_AT, HOUSING_RATIO), excited.layout.unknowns
    if here is None:
        return None
    moved = []
    for shares in TOLD_BY:
        compliance = STIFF * float((shares[:2] ** 2).mean())
        lines = excited.lines(with_hidden(unknowns, p, number, Motion(stiff, shares, compliance)))
        if lines is None:
            return None
        moved.append(lines - here)
    return np.asarray(np.linalg.solve(products_of(TOLD_BY), np.array(moved) / (STIFF * answer_of(over, stiff))))


def _likeliest(
    excited: Simulator, p: Array, sd: Array, told: Complex, sensitivity: Sensitivity, over: Array, most: int
) -> list[tuple[float, Motion]]:
    """At most so many motions that explain most, with all other unknowns where they are best beside each, the best
    first, and by how many nats."""
    target, unknowns, quadratic, here = excited.target, excited.layout.unknowns, sensitivity.quadratic, excited.lines(p)
    assert here is not None
    step, _, _ = quadratic.best(p, sd, unknowns.bounds())
    root = np.sqrt(quadratic.weights(step)[target.of_line])
    active = quadratic.active
    # A motion that is not there yet would compete.
    aside = unknowns.of((SEAT,)) | (unknowns.of((HOUSING,)) & (p <= NONE))
    kept = active[(sd[active] > 0.0) & ~aside[active]]
    others = real_parts(sensitivity.jacobian[kept] * root) * sd[kept, None]
    left = real_parts((target.lines - here) * root) + p[kept] / sd[kept] @ others

    def made_of(found: Resonance) -> Array:
        return HOUSING_SD * real_parts(told * answer_of(over, found) * root)

    return likeliest(made_of, left, others, most)


def _over(excited: Simulator) -> Array:
    """Frequencies (K,) of the lines of a simulator over those of the supports."""
    target: Target = excited.target
    lines = [frequencies(target.measurements[number])[bins] for number, _, bins in target.plan]
    return 2 * pi * np.concatenate(lines) / pace_of(excited.layout.model)


def with_hidden(unknowns: Unknowns, p: Array, number: int, motion: Motion) -> Array:
    """`p` (size,) with that motion as the one of that number of its housing."""
    shares = motion.shares
    turned = float(np.arctan2(shares[1], shares[0])) - EQUAL[number]
    low, high = (bound[unknowns[SHAPE].start + number] for bound in unknowns.bounds())
    across = shares[2:] / sqrt(float((shares[:2] ** 2).mean()))
    # Shares of the other sign are the same motion.
    turn = next((turned + k * pi for k in (0, 1, -1) if low <= turned + k * pi <= high), turned)
    out = p.copy()
    out[unknowns[HOUSING].start + number] = motion.compliance
    mode, first = unknowns[MODE].start + 2 * number, unknowns[OBLIQUE].start + 2 * number
    out[mode : mode + 2] = motion.resonance.at, log(motion.resonance.ratio / HOUSING_RATIO)
    out[unknowns[SHAPE].start + number] = turn
    out[first : first + 2] = across if turn == turned else -across
    return out
