"""The rig around its mesh, from how it answers whatever force acts there.

What no force in the mesh explains of a record (`answering`) depends on supports, masses and housing alone. So they are
found without a simulation, from anywhere; only what acts through the deflection of the mesh (supports across) is not
seen. A fit with a wrong motion of the housing does not walk to the right one: several are begun (`motions`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from gearbench.diagnosis.effects.coupling import KEY as COMPLIANCE
from gearbench.diagnosis.effects.coupling import LOSS, is_stated
from gearbench.diagnosis.effects.effect import BEYOND
from gearbench.diagnosis.effects.sensor_delay import KEYS as DELAYS
from gearbench.diagnosis.fitting.answering import (
    MOVED,
    REACTION,
    Lines,
    joined,
    left_over,
    left_over_moved,
    lines_of,
    slopes_of,
    system_of,
)
from gearbench.diagnosis.fitting.motions import with_motions
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.unknowns import Unknowns
from gearbench.diagnosis.simulation.quadratic import prior_cost, real_parts
from gearbench.diagnosis.structure.layout import Layout
from gearbench.diagnosis.structure.structure import ACROSS, CROSS, DAMPED, GAIN, HOUSED, HOUSING, SEAT, seated

Array = NDArray[np.float64]

# What is found, beside whatever else is held, without a housing; HOUSED with one.
KEYS = ("stiffness", "damping", "mass", "inertia", COMPLIANCE, LOSS, ACROSS, CROSS, DAMPED, GAIN, *DELAYS.values())
LINES, FEWEST = 200, 80  # of all records and of each, excited and operating, that are enough
# Parts of the local level below which no model is right: wide first, so that distant resonances pull.
LEVELS = (0.1, 0.01)
EVALUATIONS, FIRST = 25, 10  # of a fit, and of one by which rigs are compared
TOLERANCE = 1e-4  # part of the misfit, about a tenth of a nat, that another step must be worth
LEAST = 1e-6  # residual below which a line counts by its square


def around(layout: Layout, conditions: Sequence[Condition], held: Array) -> Array | None:
    """Unknowns (size,): `held` with those of supports, masses and housing that the records show; None where records
    have no displacement of the gears or no line, or no rig answers. Displacement sensors that are not held to stand on
    a housing are tried there too."""
    load = layout.nominal.rig.load
    # Held behind itself the driven gear hands on what its inertia leaves of the mesh's force.
    reaction = (REACTION,) if load.boundary == "speed" and not load.twists else ()
    wanted, most = (*MOVED, *reaction), max(LINES // len(conditions), FEWEST)
    found = (lines_of(layout.model, one, wanted, most) for one in conditions)
    lines = joined([one for one in found if one is not None])
    if not lines:
        return None
    unknowns, account = layout.unknowns, Account(layout, tuple(lines))
    plain = held.copy()
    for key in (CROSS, HOUSING):
        if key in unknowns.slices:
            plain[unknowns[key]] = 0.0
    try:
        best = account.fitted(plain, KEYS, LEVELS[0], EVALUATIONS)
    except ValueError:  # no rig there
        return None
    begun = [best]
    if HOUSING in unknowns.slices and not held[unknowns[SEAT]].any():
        begun.append(seated(unknowns, best))
    return with_motions(account, begun)


@dataclass(frozen=True)
class Account:
    """What a rig leaves unexplained of lines, whatever force acts in its mesh."""

    layout: Layout
    lines: tuple[Lines, ...]

    @property
    def unknowns(self) -> Unknowns:
        """Those of the layout."""
        return self.layout.unknowns

    def misfit(self, p: Array) -> float:
        """Nats that the lines cost: those of the wide level, which see a resonance from afar, and a tenth of those of
        the narrow one, which see a weak one; infinite where no rig is there."""
        try:
            system = system_of(self.layout, p)
        except ValueError:
            return inf
        total = 0.0
        for one in self.lines:
            for level, rest in zip(LEVELS, left_over(self.layout, system, one, LEVELS), strict=True):
                total += level / LEVELS[0] * float(np.log1p(np.abs(rest) ** 2).sum())
        return total

    def cost(self, p: Array) -> float:
        """The same and what the unknowns (size,) cost by their priors."""
        return self.misfit(p) + prior_cost(p, self._prior(p))

    def compared(self, begin: Array, *, faint: bool = False) -> Array:
        """`begin` (size,) where a short fit leads that a rig with a housing is compared by; `faint`: one that sees what
        answers faintly."""
        return self._led(begin, LEVELS[1] if faint else LEVELS[0], FIRST)

    def ended(self, begin: Array) -> Array:
        """`begin` (size,), which was compared, where a fit leads to the end."""
        return self._led(begin, LEVELS[1], EVALUATIONS)

    def _led(self, begin: Array, level: float, evaluations: int) -> Array:
        """`begin` (size,) where a fit of a rig with a housing leads; itself where that leads to what no rig may be."""
        try:
            return self.fitted(begin, (*KEYS, *HOUSED), level, evaluations)
        except ValueError:
            return begin

    def fitted(self, begin: Array, keys: Sequence[str], level: float, evaluations: int) -> Array:
        """`begin` (size,) with the unknowns of these keys where the misfit is least at a level."""
        at, sd = self._free(begin, keys)
        low, high = (bound[at] for bound in self.unknowns.bounds())
        fit = least_squares(
            lambda trial: self._left(_with(begin, at, trial), level, trial / sd),
            np.clip(begin[at], low, high),
            lambda trial: self._slopes(_with(begin, at, trial), level, at, sd),
            bounds=(low, high), x_scale=sd, max_nfev=evaluations, ftol=TOLERANCE, tr_solver="lsmr",
        )  # fmt: skip
        return _with(begin, at, fit.x)

    def _prior(self, p: Array) -> Array:
        """Prior standard deviations (size,): those of the background, a coupling's own where `p` (size,) has one."""
        out = self.unknowns.prior()
        at = self.unknowns[COMPLIANCE]
        # One that the case states has it where it is held beyond what is uncertain: an effect, not the nominal one.
        own = np.abs(p[at]) > BEYOND * out[at] if is_stated(self.unknowns) else p[at] > 0.0
        out[at] = np.where(own, self.unknowns.group(COMPLIANCE).wide, out[at])
        return out

    def _free(self, begin: Array, keys: Sequence[str]) -> tuple[NDArray[np.int64], Array]:
        """Numbers (n,) of the unknowns of these keys that the lines show, and their prior standard deviations."""
        unknowns = self.unknowns
        at = np.concatenate([unknowns.at(key) for key in keys])
        sd = self._prior(begin)[at]
        # Without cross-coupling nothing shows how a support yields across.
        unseen = np.zeros(unknowns.size, dtype=bool)
        for key in (ACROSS, CROSS, DAMPED):
            unseen[unknowns[key]] = begin[unknowns[CROSS]] == 0.0
        # A coupling that the case does not have is an effect: it is found where it is held to be, and not looked for.
        for key in (COMPLIANCE, LOSS) if not is_stated(unknowns) else ():
            unseen[unknowns[key]] = begin[unknowns[COMPLIANCE]] == 0.0
        kept = (sd > 0.0) & ~unseen[at]
        return at[kept], sd[kept]

    def _left(self, p: Array, level: float, departed: Array) -> Array:
        """What is left of the lines, and the unknowns in standard deviations."""
        system = system_of(self.layout, p)
        left = real_parts(np.concatenate([left_over(self.layout, system, one, (level,))[0] for one in self.lines]))
        # A line that nothing explains counts by the logarithm of its size.
        return np.concatenate([np.sign(left) * np.sqrt(np.log1p(left**2)), departed])

    def _slopes(self, p: Array, level: float, at: NDArray[np.int64], sd: Array) -> Array:
        """Derivatives of these by the unknowns `at` (n,)."""
        system = system_of(self.layout, p)
        slope = slopes_of(self.layout, p, system, at, sd)
        found = [left_over_moved(self.layout, system, slope, one, level) for one in self.lines]
        left = real_parts(np.concatenate([one for one, _ in found]))
        by = real_parts(np.concatenate([moved for _, moved in found], axis=1))
        size = np.maximum(np.abs(left), LEAST)
        by *= size / ((1.0 + size**2) * np.sqrt(np.log1p(size**2)))
        return np.concatenate([by.T, np.diag(1.0 / sd)])


def _with(p: Array, at: NDArray[np.int64], values: Array) -> Array:
    out = p.copy()
    out[at] = values
    return out
