"""The mesh law of teeth whose flanks depart from those that it was made for, all teeth of a gear alike, or whose bodies
yield otherwise.

A pair n whose flanks have the excess e_n where they touch carries its part g_n of the force as if it were pressed
further by e_n. What bends beside it, the gears' bodies, yields under the force of all pairs together:

    F = sum over pairs of F_n,   F_n = g_n(u + e_n - d_n F_n),   delta = u + (c + d) F,   g_n(delta - c F_0) = F_n0

delta is the deflection, u what is left of it for the pairs, c the compliance that the pairs share, d what they share
beyond it, d_n what pair n yields by itself beyond its own, F_0 the force of the law's own flanks, of which pair n
carries F_n0 at that deflection.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.kernels.compiled import INNER, compiled
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.nonlinear.law import MeshLaw, approach_grid

Array = NDArray[np.float64]

NODES = 131  # deflections of the table: flanks that come into contact one after another bend it more often
FINE = 4  # steps between two nodes, where forces are found before the table is read off
NOTHING = 1e-12  # m, by which flanks may differ that are alike
LEAST_LEFT = 0.9  # part of the mesh's compliance at its stiffest that less of the bodies' may take away, at most


def formed(law: MeshLaw, excess: Array | None, more: float = 0.0, own: Array | None = None) -> MeshLaw:
    """The law with the excess (n_p, n_o) [m] on each pair's working flanks beside what it has already (None: none),
    pairs that share `more` compliance [m/N], or less, and each with so much more of its `own` (n_p, n_o) [m/N].

    Deflections count from the first touch, `lead` says where that is. Back flanks are taken to be formed as the working
    ones. Raises LumpedError for excess of another shape, or beyond reason, and for bodies or teeth that would push
    back.
    """
    plain, nothing = more == 0.0 and own is None, np.zeros(law.share.shape)
    if excess is None:
        if plain:
            return law
        excess = nothing
    if excess.shape != law.share.shape:
        raise LumpedError(f"the excess on a mesh law's flanks has shape {excess.shape}, not {law.share.shape}")
    touching = law.parts[:, -1] > 0.0
    if not np.isfinite(excess).all() or not touching.any(axis=1).all():
        raise LumpedError("the excess on a mesh law's flanks must be finite, and some pair must touch at any phase")
    lead = float(excess[touching].max())
    lower = excess - lead
    if plain and lower[touching].min() > -NOTHING:
        return replace(law, lead=law.lead + lead)
    _check_yielding(law, more)
    if own is None:
        own = nothing
    else:
        _check_teeth(law, own)
    left = law.approach[-1] - float(np.where(touching, lower, -np.inf).max(axis=1).min())
    deepest = left + more * float(law.force[:, -1].max() if more < 0.0 else law.force[:, -1].min())
    deepest += max(float((own * law.parts[:, -1]).max()), 0.0)
    # Bodies that yield otherwise bend nothing.
    nodes = len(law.approach) if lower[touching].min() > -NOTHING else NODES
    approach = approach_grid(deepest, nodes)
    trial = approach_grid(left, FINE * (nodes - 1) + 1)

    def of_pairs(standing_back: Array, yielding: Array, sharing: float) -> Array:
        parts = np.zeros((law.phases, nodes, len(law.offsets)))
        _press(law.approach, law.parts, standing_back, yielding, law.shared, sharing, trial, approach, parts)
        return parts

    parts, before = of_pairs(lower, own, law.shared + more), of_pairs(nothing, nothing, law.shared)
    # The law's own shares are finer than its table: what the flanks change them by is read off two alike ones.
    level = law.reference_force
    share = np.clip(law.share + _shares(parts, level) - _shares(before, level), 0.0, None)
    return replace(
        law,
        approach=approach,
        force=parts.sum(axis=2),
        parts=parts,
        share=share / share.sum(axis=1, keepdims=True),
        shared=law.shared + more,
        lead=law.lead + lead,
    )


def _check_teeth(law: MeshLaw, own: Array) -> None:
    """Refuse teeth that yield so much less that deflections do not grow with the force."""
    slopes = np.diff(law.parts, axis=1) / np.diff(law.approach)[:, None]
    left = 1.0 - law.shared * slopes.sum(axis=2, keepdims=True)
    if (left + own[:, None] * slopes < (1.0 - LEAST_LEFT) * left).any():
        raise LumpedError(
            "rig.mesh.end_compliance_um_per_kn and tilt_compliance_um_per_kn take more than a pair of teeth yields by"
            " itself: they must lie nearer 0"
        )


def _check_yielding(law: MeshLaw, more: float) -> None:
    """Refuse bodies that yield so much less that deflections do not grow with the force."""
    stiffest = float((np.diff(law.force, axis=1) / np.diff(law.approach)).max())
    if more * stiffest <= -LEAST_LEFT:
        raise LumpedError(
            f"rig.mesh.shared_compliance_um_per_kn = {1e9 * more:g} takes more than the mesh yields: it must lie above"
            f" {-1e9 * LEAST_LEFT / stiffest:.4g}"
        )


@compiled(**INNER)
def _carried(places: Array, parts: Array, o: int, lower: float, trial: Array, found: Array) -> None:
    """Fill found[:, o] with the force of pair o, which stands back by `lower` <= 0, at rising deflections `trial`: by
    straight lines through (places, parts[:, o]), beyond their end as between the last two."""
    last, k = len(places) - 1, 1
    for n in range(len(trial)):
        u = trial[n] + lower
        while k < last and places[k] < u:
            k += 1
        slope = (parts[k, o] - parts[k - 1, o]) / (places[k] - places[k - 1])
        found[n, o] = max(parts[k - 1, o] + slope * (u - places[k - 1]), 0.0) if u > 0.0 else 0.0


@compiled
def _press(
    approach: Array,
    parts: Array,
    excess: Array,
    own: Array,
    shared: float,
    sharing: float,
    trial: Array,
    wanted: Array,
    out: Array,
) -> None:
    """Fill `out` (phases, wanted, n_o) with what each pair carries at the `wanted` deflections, from forces `parts`
    at `approach`; excess (phases, n_o) <= 0; compliances [m/N] that are each pair's `own` (phases, n_o) beside those
    there, that pairs `shared` there and are `sharing`; trial: deflections of the pairs, beside what they share, to
    begin with."""
    count = parts.shape[2]
    found = np.zeros((len(trial), count))
    depth, bare, places = np.zeros(len(trial)), np.zeros(len(approach)), np.zeros(len(approach))
    for i in range(parts.shape[0]):
        for j in range(len(approach)):
            bare[j] = approach[j]
            for o in range(count):
                bare[j] -= shared * parts[i, j, o]
        for o in range(count):
            for j in range(len(approach)):
                places[j] = bare[j] + own[i, o] * parts[i, j, o]
            _carried(places, parts[i], o, excess[i, o], trial, found)
        for n in range(len(trial)):
            depth[n] = trial[n]
            for o in range(count):
                depth[n] += sharing * found[n, o]
        n = 1
        for j in range(len(wanted)):
            while n < len(trial) - 1 and depth[n] < wanted[j]:
                n += 1
            weight = (wanted[j] - depth[n - 1]) / (depth[n] - depth[n - 1])
            for o in range(count):
                out[i, j, o] = max(found[n - 1, o] + weight * (found[n, o] - found[n - 1, o]), 0.0)


def _shares(parts: Array, level: float) -> Array:
    """Parts (phases, n_o) of the pairs in the tangent stiffness at the node below a force."""
    force = parts.sum(axis=2)
    node = np.clip((force < level).sum(axis=1) - 1, 0, force.shape[1] - 2)
    rows = np.arange(len(force))
    tangent = np.maximum(parts[rows, node + 1] - parts[rows, node], 0.0)
    return np.asarray(tangent / tangent.sum(axis=1, keepdims=True))
