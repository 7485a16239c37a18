"""Sizes of an effect as a verdict states them: by the parameters that tell them, with their units."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearbench.diagnosis.detection.smallest import View, direction, largest, smallest
from gearbench.diagnosis.effects.effect import Estimate
from gearbench.diagnosis.structure.layout import Layout


class Sizes(NamedTuple):
    """The smallest size that is `found` in standard deviations of the wide prior (None: none within its bounds), and
    that of a good rig, `sound`; the parameters that tell it, as they are `stated` of the smallest size (of the largest
    where none is found) and of a `good` rig."""

    found: float | None
    sound: float
    stated: tuple[Estimate, ...]
    good: tuple[Estimate, ...]


def stated_at(layout: Layout, view: View, number: int, size: float) -> tuple[Estimate, ...]:
    """The parameters that tell the size of an effect, as a verdict would state them, the foremost first."""
    one = view.hypotheses[number]
    assert one.effect is not None
    fitted = layout.fitted(size * direction(view.known, one), view.std(number))
    return tuple(told for told in one.effect.add(layout.nominal.rig, one, fitted)[1] if told.sized)


def sizes_of(layout: Layout, view: View, number: int) -> Sizes:
    """The sizes of a hypothesis by its number."""
    one, unknowns = view.hypotheses[number], view.known.unknowns
    found, at = smallest(view, number), one.entries(unknowns)
    sound = float(np.sqrt(np.mean((unknowns.prior()[at] / direction(view.known, one)[at]) ** 2)))
    stated = stated_at(layout, view, number, largest(view.known, one) if found is None else found)
    return Sizes(found, sound, stated, stated_at(layout, view, number, sound))
