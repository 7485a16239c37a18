"""What an effect is to the diagnosis: its unknowns, where it may be, how it is put into a rig, and its words.

A file of this folder makes one `Effect`; a line in `library` adds it to what is searched for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns
from gearbench.rig import Case, Rig
from gearbench.rig.contract import Place

Array = NDArray[np.float64]

SIDES = ("driver", "driven")
SUPPORT_PLACES: dict[str, Place] = {"driver": "driver-support", "driven": "driven-support"}
# Standard deviations of a number of the nominal rig within which no cause is needed: a contract of the verdict's names.
BEYOND = 3.0
# Relative error that the simplicity of the model leaves at least: four rigs of each effect do not tell less.
LEAST_MODEL_ERROR = 0.02


@dataclass(frozen=True)
class Wide:
    """A prior that is made wide: of a whole group of unknowns, or of the entry `at` in it; `sd` in the group's unit,
    None: the group's own wide one."""

    key: str
    at: int | None = None
    sd: float | None = None

    def entries(self, unknowns: Unknowns) -> NDArray[np.int64]:
        """Indices of the unknowns whose priors are wide."""
        whole = unknowns.at(self.key)
        return whole if self.at is None else whole[[self.at]]

    def into(self, unknowns: Unknowns, sd: Array) -> None:
        """Put the wide standard deviations into `sd` (size,)."""
        entries = self.entries(unknowns)
        if self.sd is not None:
            sd[entries] = self.sd
        else:
            sd[entries] = unknowns.group(self.key).wide[entries - unknowns[self.key].start]


@dataclass(frozen=True)
class Hypothesis:
    """An effect (None: a free form) at a place, by the priors that it makes `wide`.

    `name` tells it from others of the same effect, `on` says which gears or channels it is about, `choices` out of how
    many like it it was picked. Of those that differ by a tooth's number only one for each gear is `representative` of
    what forces can tell apart. A rare one is not named where a `usual` one like it explains the records nearly as well:
    keys of the unknowns of such, and how many times those of this one they are for the same transmission error.
    `twins`: keys of the unknowns by which the other gear makes lines of the same frequencies.
    """

    name: str
    place: Place
    wide: tuple[Wide, ...]
    on: tuple[str, ...] = ()
    choices: int = 1
    representative: bool = True
    usual: tuple[tuple[str, ...], float] | None = None
    twins: tuple[str, ...] = ()
    effect: Effect | None = None

    def entries(self, unknowns: Unknowns) -> NDArray[np.int64]:
        """Indices of the unknowns whose priors are wide."""
        return np.concatenate([one.entries(unknowns) for one in self.wide])

    def gives_way_to(self, other: Hypothesis) -> bool:
        """Whether the other is a usual one like this rare one."""
        return self.usual is not None and any(wide.key in self.usual[0] for wide in other.wide)

    def is_twin_of(self, other: Hypothesis) -> bool:
        """Whether the other is the same in the other gear, and makes lines of the same frequencies."""
        return all(wide.key in self.twins for wide in other.wide)

    def prior(self, unknowns: Unknowns) -> Array:
        """Prior standard deviations (size,) under this hypothesis."""
        return self.widened(unknowns, unknowns.prior())

    def widened(self, unknowns: Unknowns, sd: Array) -> Array:
        """The prior `sd` (size,) with that of this hypothesis made wide."""
        return widened(unknowns, self.wide, sd)


def twins_of(keys: Mapping[str, str], side: str, teeth: Sequence[int]) -> tuple[str, ...]:
    """Keys by which the other gear turns as often: of `keys` by gear, none where the numbers of teeth differ."""
    return tuple(key for other, key in keys.items() if other != side) if teeth[0] == teeth[1] else ()


def widened(unknowns: Unknowns, wide: Sequence[Wide], sd: Array) -> Array:
    """Prior standard deviations `sd` (size,) with some made wide."""
    out = sd.copy()
    for one in wide:
        one.into(unknowns, out)
    return out


@dataclass(frozen=True)
class Fitted:
    """Values and standard deviations (size,) of the unknowns of one fit to the records of a nominal model."""

    model: NominalModel
    unknowns: Unknowns
    p: Array
    std: Array
    torque_mean: Mapping[str, float]  # by condition [N m]

    def of(self, key: str) -> Array:
        """Values of a group."""
        return self.p[self.unknowns[key]]

    def std_of(self, key: str) -> Array:
        """Standard deviations of a group."""
        return self.std[self.unknowns[key]]


@dataclass(frozen=True)
class Estimate:
    """One parameter of an effect as its users read it; `sized`: the simplicity of the model limits how well it is
    known, as it does not limit a tooth's number or a phase; `signed`: a size that may be less than nothing."""

    name: str
    value: float
    std: float
    unit: str
    sized: bool = True
    signed: bool = False


Added = tuple[Rig, tuple[Estimate, ...]]


def no_unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Of an effect that makes priors of the background wide."""
    return ()


def no_starts(group: Group) -> tuple[float, ...]:
    """Of an effect whose influence is nearly linear: the search finds it from zero."""
    return ()


def no_shapes(model: NominalModel) -> Array:
    """Of an effect that simulation finds from zero."""
    return np.empty((0, 0))


@dataclass(frozen=True)
class Effect:
    """An effect that a simulation may leave out.

    Words: `name` as verdicts have it, `noun` as a sentence does, `meaning` what it is and where to look,
    `parameters` the last part of a parameter's name in an engineer's words. Rig: `fields`, dotted from the case,
    that `add(rig, hypothesis, fitted)` moves when it puts what was fitted into a rig. Model: `unknowns(model,
    conditions)` with bounds and priors, `hypotheses_of(model)` where it may be, and `starts(group)`, values of the
    group of a hypothesis to begin the search from besides zero; `shapes(model)`, values (n, entries) of `shaped`,
    the group that simulation begins from where following the slope from zero does not get there. Search: it is
    refitted whatever the background's quadratic predicts (`always`), in `most_refits` of its hypotheses at most.
    Decision: `limit` of its evidence and `least_size`, if they are not those of all effects. `model_error`:
    relative error of a rightly named one beyond that of the fit; `force_error`: the same where the force residuals
    alone name it, if it is larger.
    """

    name: str
    noun: str
    meaning: str
    parameters: Mapping[str, str]
    fields: tuple[str, ...]
    hypotheses_of: Callable[[NominalModel], tuple[Hypothesis, ...]]
    add: Callable[[Rig, Hypothesis, Fitted], Added]
    unknowns: Callable[[NominalModel, Sequence[Condition]], tuple[Group, ...]] = no_unknowns
    starts: Callable[[Group], tuple[float, ...]] = no_starts
    shapes: Callable[[NominalModel], Array] = no_shapes
    shaped: str = ""
    always: bool = False
    most_refits: int | None = None
    limit: float | None = None
    least_size: float | None = None
    model_error: float = LEAST_MODEL_ERROR
    force_error: float = 0.0

    def hypotheses(self, model: NominalModel) -> tuple[Hypothesis, ...]:
        """The effect in every place where it may be."""
        return tuple(replace(one, effect=self) for one in self.hypotheses_of(model))

    def stated(self, estimate: Estimate, *, by_forces: bool = False) -> float:
        """Standard deviation to state for a parameter: the fit's and, for a size, the model's error, which is that of
        the force residuals alone where it was found `by_forces`."""
        error = max(self.model_error, self.force_error) if by_forces else self.model_error
        return hypot(estimate.std, error * estimate.value) if estimate.sized else estimate.std


def added(case: Case, hypothesis: Hypothesis, fitted: Fitted) -> tuple[Case, tuple[Estimate, ...]]:
    """The case with the effect of the hypothesis, which has one, put into its rig, and its parameters."""
    assert hypothesis.effect is not None
    rig, estimates = hypothesis.effect.add(case.rig, hypothesis, fitted)
    return with_rig(case, rig), estimates


def with_rig(case: Case, rig: Rig) -> Case:
    """The case with another rig."""
    return case.model_copy(update={"rig": rig})


def changed(rig: Rig, part: str, **update: object) -> Rig:
    """The rig with fields of one of its parts replaced."""
    return rig.model_copy(update={part: getattr(rig, part).model_copy(update=update)})


def of_gears(path: str) -> tuple[str, ...]:
    """A path with {} for either gear: `rig.{}.runout`."""
    return tuple(path.format(side) for side in SIDES)
