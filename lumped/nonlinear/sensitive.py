"""How the mesh's elastic force answers the numbers of its law at an unchanged deflection, at instants: an exponent,
compliance that the pairs share or each has by itself, and errors of the flanks' form.

Where teeth differ, each pair o carries what the law gives it where all pairs are pressed as far as this one,
f_o(delta_o) = g_o(u) (F_0 / F_ref)^n with delta_o = u + c F_0: F_0 is the force of all there without the exponent n, c
the compliance that they share (`lumped.nonlinear.forms`). An error e_p of the form of pair p moves it by

    d f_o = (F_0 / F_ref)^n (g_o' (d e_o - c sum_p t_p d e_p) + n g_o / F_0 sum_p t_p d e_p),   t_p = g_p' / (1 + c G')

with t_p the tangents of the law's parts and G' the sum of all g_p'. What pair p yields by itself is such an error of
minus its compliance times g_p.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.lumped.nonlinear.pressing import Instants, Pressed
from gearbench.lumped.nonlinear.reading import over_pairs, read_pairs

Array = NDArray[np.float64]

LEAST_LEVEL = 1e-4  # of the load at which an exponent changes nothing, below which its logarithm is cut


class Sensitivities(NamedTuple):
    """At instants (n,): `level`, the relative change of the force by the exponent, logarithm of a force over the
    reference; `sharing` [N/m], that by compliance which the pairs share more; `form` (n, n_o) [N/m], what the force
    grows by per excess that a pair's flanks have more by their form, and `own` (n, n_o) [N2/m], per compliance that the
    pair has less by itself."""

    level: Array
    sharing: Array
    form: Array
    own: Array


def sensitivities(
    law: MeshLaw, at: Instants, travel: Array, whole: Pressed, exponent: float, reference: float
) -> Sensitivities:
    """Those of a law at the DTE `travel` (n,) [m], where all pairs carry `whole`; `exponent` is in the law, `reference`
    [N] the force at which it changes nothing."""
    if at.differ:
        depths = travel[:, None] + at.excess[:, None] + at.pair_excess
        parts = [_part(law, at.phase, depth, pair, exponent, reference) for pair, depth in enumerate(depths.T)]
        gains = list(at.pair_gain.T)
    else:
        parts, gains = [_part(law, at.phase, travel + at.excess, None, exponent, reference)], [np.ones(travel.size)]

    def total(of: Callable[[_Part], Array]) -> Array:
        return np.sum([(gain * of(part).T).T for gain, part in zip(gains, parts, strict=True)], axis=0)

    force = total(lambda part: part.force)
    working = np.where(force > 0.0, force, np.inf)
    level, sharing = total(lambda part: part.level) / working, total(lambda part: part.sharing) / working
    form, own = at.gain[:, None] * total(lambda part: part.form), at.gain[:, None] * total(lambda part: part.own)
    back = whole.force < 0.0
    depth = (np.abs(whole.force / at.gain) / reference) ** (1.0 / (1.0 + exponent))
    level = np.where(back, np.log(np.maximum(depth, LEAST_LEVEL)), level)
    sharing = np.where(back, whole.tangent * depth * reference / np.where(back, -whole.force, 1.0), sharing)
    form, own = (np.where(back[:, None], 0.0, one) for one in (form, own))
    return Sensitivities(level, sharing, form, own)


class _Part(NamedTuple):
    """Of what one pair carries, or all (n,): the force [N], the same times the logarithm of the level, and times what
    shared compliance takes from it [N/m]; (n, n_o) what it grows by with the forms of all pairs [N/m], and with less
    compliance of their own [N2/m]."""

    force: Array
    level: Array
    sharing: Array
    form: Array
    own: Array


def _part(
    law: MeshLaw, phase: Array, depth: Array, pair: int | None, exponent: float, reference: float
) -> _Part:
    """That of one pair, or of all, where all are pressed by `depth` (n,) [m]."""
    n = exponent
    force, tangent = read_pairs(law, np.broadcast_to(depth[:, None], (depth.size, len(law.offsets))), phase)
    whole, stiff = over_pairs(force), over_pairs(tangent)
    loaded = whole > 0.0
    safe = np.where(loaded, whole, 1.0)
    level = np.where(loaded, whole / reference, 0.0) ** (1.0 / (1.0 + n))
    log = np.log(np.maximum(level, LEAST_LEVEL))
    # Tangents of the parts at an unchanged level: what is left without the growth of the level itself.
    bare = tangent - n / (1.0 + n) * force * (stiff / safe)[:, None]
    lift = np.where(loaded, level, 1.0) ** n
    plain = force / lift[:, None]
    if pair is None:
        form = (1.0 + n) * bare
        return _Part(whole, whole * log, stiff * level * reference, form, form * plain)
    alone = bare[:, pair] / np.maximum(1.0 - law.shared * over_pairs(bare) / lift, 1e-3)
    form = (n * force[:, pair] / safe - law.shared * alone / lift)[:, None] * bare
    form[:, pair] += alone
    return _Part(force[:, pair], force[:, pair] * log, tangent[:, pair] * level * reference, form, form * plain)
