"""The unknowns of the output error: those of the force residuals that a rig can have, and the structure of real rigs.

A vector of unknowns makes a rig: the nominal one, recalibrated, with every effect in it at once.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.background import background
from gearbench.diagnosis.effects.bearing_nonlinearity import KEYS as BEARINGS
from gearbench.diagnosis.effects.contact_nonlinearity import KEY as CONTACT
from gearbench.diagnosis.effects.contact_nonlinearity import SD_SIMULATED
from gearbench.diagnosis.effects.coupling import COUPLING
from gearbench.diagnosis.effects.coupling import KEY as COMPLIANCE
from gearbench.diagnosis.effects.effect import SIDES, Fitted, Hypothesis, changed, with_rig
from gearbench.diagnosis.effects.library import LIBRARY
from gearbench.diagnosis.effects.mesh_damping import KEY as RATIO
from gearbench.diagnosis.effects.mesh_damping import deviation
from gearbench.diagnosis.effects.recalibrated import recalibrated
from gearbench.diagnosis.effects.sensor_delay import KEYS as DELAYS
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.effects.tooth_crack import LARGEST
from gearbench.diagnosis.effects.torque_ripple import KEY as RIPPLE
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, unknowns_of
from gearbench.diagnosis.structure.contrast import contrast_groups, contrasted, tangents_of
from gearbench.diagnosis.structure.ends import Ends, ended, ends_groups, ends_of
from gearbench.diagnosis.structure.rubbing import rubbing, rubbing_groups
from gearbench.diagnosis.structure.structure import held, least_steps, sensed, structure_groups
from gearbench.diagnosis.structure.viscous import viscous, viscous_groups
from gearbench.geometry import Pair, pair
from gearbench.rig import Case, Rig
from gearbench.rig.gear import Crack

Array = NDArray[np.float64]

# Of the background those that no field of a rig holds, and the zero of the angles, which force residuals need to know
# the deflection: a simulated rig has its own, and material that all its working flanks lack would be backlash.
FORCES_ONLY = ("compliance", "radial", "offset")
LEAST_LOSS = 1e-6
# Effects that are put into a rig whatever their size.
PLAIN = ("friction", "eccentricity", "pitch-error", "profile-error", "backlash", "contact-nonlinearity",
         "encoder-runout")  # fmt: skip


@dataclass(frozen=True)
class Layout:
    """The unknowns of a nominal case, and how a rig is made of them. `teeth` are the teeth that may be cracked, by
    number; `torque_mean` [N m] of every condition."""

    nominal: Case
    model: NominalModel
    unknowns: Unknowns
    teeth: tuple[int, ...]
    torque_mean: Mapping[str, float]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.unknowns.size

    def fitted(self, p: Array, std: Array | None = None) -> Fitted:
        """Values of the unknowns as effects take them."""
        return Fitted(self.model, self.unknowns, p, np.zeros(p.size) if std is None else std, self.torque_mean)

    @cached_property
    def meshing(self) -> Pair:
        """The geometry of the nominal pair."""
        return pair(self.nominal.rig)

    @cached_property
    def tangents(self) -> Array:
        """Stiffness (phases,) [N/m] of the nominal mesh over its phase, without its scale."""
        return tangents_of(self.model)

    @cached_property
    def ends(self) -> Ends:
        """What the pairs of the nominal mesh yield by themselves, and where they touch."""
        return ends_of(self.model, self.meshing)

    def case(self, p: Array, condition: str | None = None) -> Case:
        """The rig of these unknowns (size,), with the ripple of one condition, or the mean of all. Raises ValueError
        for values that no rig may have."""
        fitted = self.fitted(p)
        case = recalibrated(self.nominal, fitted)
        rig = case.rig
        for effect in LIBRARY:
            if effect.name in PLAIN:
                rig = effect.add(rig, _all_of(effect.name), fitted)[0]
        rig = _cracked(rig, self, p)
        rig = held(_supports(rig, self, p), self.model, self.unknowns, p)
        rig = contrasted(rig, self.tangents, self.unknowns, p)
        rig = ended(rig, self.ends, self.unknowns, p)
        rig = rubbing(viscous(rig, self.model, self.unknowns, p), self.unknowns, p)
        rig = sensed(rig, self.model, self.unknowns, p, DELAYS)
        rig = _drive(rig, self, fitted, condition)
        return with_rig(case, rig)


def around_mesh(layout: Layout, p: Array) -> Rig:
    """What holds the gears in the rig of these unknowns (size,), without what is in their mesh, drive and sensors.
    Raises ValueError for values that no rig may have."""
    fitted = layout.fitted(p)
    rig = _supports(recalibrated(layout.nominal, fitted).rig, layout, p)
    return _coupled(held(rig, layout.model, layout.unknowns, p), layout, fitted)


def _all_of(name: str) -> Hypothesis:
    """A hypothesis of which only the values count, not the estimates."""
    return Hypothesis(name, "none", ())


def layout_of(
    nominal: Case, model: NominalModel, conditions: Sequence[Condition], teeth: Sequence[int]
) -> Layout:
    """The unknowns for these conditions."""
    groups: list[Group] = [one for one in background(model) if one.key not in FORCES_ONLY]
    for effect in LIBRARY:
        groups += effect.unknowns(model, conditions)
    groups += structure_groups(nominal.rig, model)
    groups += [*contrast_groups(), *ends_groups(), *viscous_groups(nominal, model), *rubbing_groups()]
    # What force residuals take for these has other errors of theirs in it.
    known = {CONTACT: SD_SIMULATED, RATIO: deviation(model)}
    plain = [_as_simulated(one, known.get(one.key)) for one in groups]
    means = {condition.name: condition.torque_mean for condition in conditions}
    return Layout(nominal, model, unknowns_of(plain, sum(model.teeth)), tuple(teeth), means)


def _as_simulated(one: Group, sd: float | None) -> Group:
    """A group of the force residuals as output error moves it, with another prior where one is given."""
    # Bases belong to force residuals: here unknowns are moved one by one.
    plain = replace(one, basis=None)
    if sd is None:
        return plain
    own = one.wide > one.sd  # else it is a number of the nominal rig, which has no wider prior
    return replace(plain, sd=np.full_like(one.sd, sd), wide=np.where(own, one.wide, sd))


def _cracked(rig: Rig, layout: Layout, p: Array) -> Rig:
    """The largest loss of either gear as its crack."""
    losses = p[layout.unknowns[CRACK]]
    z1 = layout.model.teeth[0]
    for side, part, first in (("driver", losses[:z1], 0), ("driven", losses[z1:], z1)):
        tooth = int(np.argmax(part))
        if part[tooth] > LEAST_LOSS and first + tooth in layout.teeth:
            crack = Crack(tooth=tooth, stiffness_loss=min(float(part[tooth]), LARGEST))
            rig = changed(rig, side, crack=crack)
    return rig


def _supports(rig: Rig, layout: Layout, p: Array) -> Rig:
    unknowns, model = layout.unknowns, layout.model
    update = {}
    for number, side in enumerate(SIDES):
        support = getattr(rig.support, side)
        exponent = model.exponent[number] + float(p[unknowns[BEARINGS[side]]][0])
        more = {"exponent": exponent, "reference_deflection": model.reference[number]} if exponent else {}
        update[side] = support.model_copy(update=more)
    return changed(rig, "support", **update)


def _coupled(rig: Rig, layout: Layout, fitted: Fitted) -> Rig:
    least = least_steps(layout.unknowns).get(COMPLIANCE, 0.0)
    if layout.model.rotor > 0.0 and layout.model.compliance + float(fitted.of(COMPLIANCE)[0]) >= least:
        rig = COUPLING.add(rig, _all_of("coupling"), fitted)[0]
    return rig


def _drive(rig: Rig, layout: Layout, fitted: Fitted, condition: str | None) -> Rig:
    rig = _coupled(rig, layout, fitted)
    if not np.any(fitted.of(RIPPLE)):
        return rig
    ripple = next(one for one in LIBRARY if one.name == "torque-ripple")
    if condition in layout.torque_mean:
        values = fitted.of(RIPPLE).reshape(len(layout.torque_mean), -1)
        chosen = list(layout.torque_mean).index(str(condition))
        own = np.zeros(layout.size)
        own[layout.unknowns[RIPPLE]] = np.tile(values[chosen], len(layout.torque_mean))
        fitted = layout.fitted(own, np.ones(layout.size))
    else:
        fitted = layout.fitted(fitted.p, np.ones(layout.size))
    return ripple.add(rig, _all_of("torque-ripple"), fitted)[0]
