"""The mesh law of the non-linear lumped model: solved statically on the condensed gears, or from k(phase)."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import ceil, log, pi
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig, elastic_rig
from gearbench.bench.errors import BenchError
from gearbench.bench.refusals.load_range import largest_torque
from gearbench.fem.contact.law import EDGE_SEPARATION, PAIRS, Law
from gearbench.fem.contact.sharing import newton_step
from gearbench.fem.contact.static import position, static_cycle
from gearbench.fem.gear.store import cached, key_for
from gearbench.files import digest_of
from gearbench.geometry import Pair, pair
from gearbench.geometry.pair.touching import touching_excess
from gearbench.geometry.tooth.profile import involute
from gearbench.kernels.compiled import compiled
from gearbench.lumped import mesh_stiffness
from gearbench.lumped.nonlinear.forms import formed
from gearbench.lumped.nonlinear.law import REFERENCE, MeshLaw, approach_grid
from gearbench.lumped.stiffness.potential_energy import hertz_compliance, tooth_compliance
from gearbench.rig import Gear, MeshCorrection, Rig, Simulation
from gearbench.rig.neutral import is_formed, relieved_gear, without_reliefs

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

PHASES = 512
NODES = 67
LOAD_STEP = 2**0.5  # tables are solved up to the next power of this [N m], so that similar loads share them
OFFSETS = 4  # pairs looked at on either side of the one at the pitch point


def mesh_law(rig: Rig, simulation: Simulation, load_max_nm: float) -> MeshLaw:
    """Law of the rig's gears up to at least the driver torque `load_max_nm` [N m], with what all teeth of a gear lack
    or have beside their involutes.

    With simulation.mesh_stiffness = "finite-element" from static contact of the condensed gears, tip-edge contact and
    reliefs included, from disk where it has been solved before; else linear in the deflection, with the stiffness
    k(phase) that the case asks for. Raises GeometryError, ContactError, LumpedError or BenchError.
    """
    teeth = teeth_law(rig, simulation, load_max_nm)
    return with_flanks(teeth, rig, simulation)


def with_flanks(teeth: MeshLaw, rig: Rig, simulation: Simulation) -> MeshLaw:
    """The `teeth_law` with the flanks and the compliances of a rig's mesh."""
    own = own_compliance(teeth, pair(rig), rig.mesh)
    return formed(teeth, flank_excess(teeth, rig, simulation), rig.mesh.shared_compliance, own)


def own_compliance(teeth: MeshLaw, meshing: Pair, mesh: MeshCorrection) -> Array | None:
    """What each pair yields more by itself (phases, n_o) [m/N] than by the `teeth_law`: the end compliance of a rig's
    mesh times x^2 - 1/3 and its tilt compliance times x, x its place on the path of contact from -1 to 1, and no more
    beyond its ends; None for nothing."""
    uneven = np.array([mesh.end_compliance, mesh.tilt_compliance])
    if not uneven.any():
        return None
    phase = np.arange(teeth.phases)[:, None] / teeth.phases
    return np.tensordot(uneven, meshing.uneven(phase - teeth.offsets), 1)


def flank_excess(teeth: MeshLaw, rig: Rig, simulation: Simulation) -> Array | None:
    """What each pair's flanks have (phases, n_o) [m] that is not in the `teeth_law`, all teeth of a gear alike: slope,
    form and wear, and reliefs where the law does not come from finite elements; None for involutes."""
    gears = [rig.driver, rig.driven]
    if simulation.mesh_stiffness == "finite-element":
        gears = [without_reliefs(gear) for gear in gears]
    if not any(is_formed(gear) for gear in gears):
        return None
    return touching_excess(pair(rig), (gears[0], gears[1]), teeth.rho1)


def teeth_law(rig: Rig, simulation: Simulation, load_max_nm: float) -> MeshLaw:
    """Law of the rig's sound, error-free gears; arguments and refusals as those of `mesh_law`."""
    sound = rig.model_copy(update={"driver": relieved_gear(rig.driver), "driven": relieved_gear(rig.driven)})
    if simulation.mesh_stiffness != "finite-element":
        return linear_law(sound, simulation)
    meshing = pair(sound)
    load = _table_load(meshing, load_max_nm)
    values: dict[str, Any] = {
        "driver": _bare(sound.driver),
        "driven": _bare(sound.driven),
        "material": sound.material,
        "centre": meshing.centre_distance,
        "element_size": simulation.element_size,
        "element": simulation.element,
        "load": load,
        "source": _source(),
    }
    arrays = cached(key_for("mesh-law", values), lambda: _solve(elastic_rig(sound, simulation), load))
    law = _assemble(sound, meshing, arrays["approach"], arrays["force"], arrays["share"], arrays["parts"])
    return replace(law, shared=float(arrays["shared"]))


def linear_law(rig: Rig, simulation: Simulation) -> MeshLaw:
    """Law linear in the deflection, F = k(phase) delta; every pair within its path of contact carries the part that its
    own stiffness by the potential energy method has in the sum of them."""
    meshing = pair(rig)
    phase = np.arange(PHASES) / PHASES
    k = mesh_stiffness(rig, meshing, simulation).at(phase, finest=2.0 / PHASES)
    approach = approach_grid(1e-4, 3)
    one, two, hertz, inside = _compliances(rig, meshing, _travel(meshing, phase))
    share = np.where(inside, 1.0 / (one + two + hertz), 0.0)
    share /= share.sum(axis=1, keepdims=True)
    force = k[:, None] * approach
    return _assemble(rig, meshing, approach, force, share, force[..., None] * share[:, None])


def _bare(gear: Gear) -> Gear:
    """Without what the static law does not depend on."""
    return gear.model_copy(update={"mass": None, "inertia": None, "bore_radius": 0.0})


def _table_load(meshing: Pair, load_max: float) -> float:
    """Driver torque [N m] up to which the table is solved: the next step, within what the flanks can carry."""
    if not (np.isfinite(load_max) and load_max > 0):
        raise BenchError(f"the largest load of a mesh law must be positive and finite, not {load_max:g} N m")
    most = largest_torque(meshing)
    if load_max > most:
        raise BenchError(
            f"a driver torque of {load_max:.4g} N m is more than the modelled flanks can carry: at most {most:.4g} N m"
            " for this pair"
        )
    return float(min(LOAD_STEP ** ceil(log(load_max) / log(LOAD_STEP) - 1e-9), most))


@lru_cache(maxsize=1)
def _source() -> str:
    """Hash of this file: tables that another state of it has solved are not taken from disk."""
    return digest_of(Path(__file__))


@compiled
def _force_table(law: Law, phases: Array, dte: Array, first: int, force: Array, parts: Array) -> int:
    """Fill force (phases, dte) [N] and what each pair carries of it (phases, dte, offsets), the first of them number
    `first`; returns the number of positions that did not converge."""
    failed = 0
    for i in range(len(phases)):
        guess = np.zeros(PAIRS)
        for j in range(len(dte)):
            theta1 = phases[i] * law.driver.pitch + dte[j] / law.driver.rb
            found = position(law, theta1, phases[i] * law.driven.pitch, 0.0, 0.0, 0.0, 0.0, guess)
            force[i, j] = found.torque_driver / law.driver.rb
            for p in range(len(found.pairs)):
                column = found.pairs[p].tooth - first
                if found.pairs[p].side == 0 and 0 <= column < parts.shape[2]:
                    parts[i, j, column] += found.pairs[p].lever1 * found.force[p] / law.driver.rb
            failed += 0 if found.converged else 1
    return failed


@compiled
def _tangent_shares(law: Law, phases: Array, dte: Array, first: int, share: Array) -> float:
    """Fill share (phases, offsets): part of each working pair in the tangent stiffness at the given deflections.
    Returns the mean compliance [m/N] from one pair's force to the next one's deflection, 0 where none has a next."""
    shared, seen = 0.0, 0
    for i in range(len(phases)):
        theta1 = phases[i] * law.driver.pitch + dte[i] / law.driver.rb
        found = position(law, theta1, phases[i] * law.driven.pitch, 0.0, 0.0, 0.0, 0.0, np.zeros(PAIRS))
        stiff = newton_step(np.ones(len(found.pairs)), found.flexibility, found.active)
        total = 0.0
        for p in range(len(found.pairs)):
            column = found.pairs[p].tooth - first
            if found.pairs[p].side == 0 and found.active[p] and 0 <= column < share.shape[1]:
                share[i, column] = stiff[p]
                total += stiff[p]
        for column in range(share.shape[1]):
            share[i, column] /= total
        for p in range(1, len(found.pairs)):
            if found.active[p] and found.active[p - 1] and found.pairs[p].side + found.pairs[p - 1].side == 0:
                shared += found.flexibility[p, p - 1]
                seen += 1
    return shared / max(seen, 1)


def _solve(elastic: ElasticRig, load: float) -> dict[str, Array]:
    """Arrays approach, force, share and shared of the elastic pair."""
    law, phase = elastic.law, np.arange(PHASES) / PHASES
    coarse = phase[:: PHASES // 64]
    deepest = float(static_cycle(law, coarse, torque=[load]).transmission_error.max())
    deepest = min(1.02 * deepest, EDGE_SEPARATION * elastic.pair.driver.module)
    approach = approach_grid(deepest, NODES)
    force, parts = np.zeros((PHASES, NODES)), np.zeros((PHASES, NODES, 2 * OFFSETS + 1))
    failed = _force_table(law, phase, approach[1:], -OFFSETS, force[:, 1:], parts[:, 1:])
    if failed:
        raise BenchError(f"{failed} of {force.size} positions of the mesh law found no static equilibrium")
    # The deflection that carries the reference load, between the nodes of the table.
    reference = REFERENCE * load / elastic.pair.driver.base_radius
    dte = np.array([np.interp(reference, row, approach) for row in force])
    share = np.zeros((PHASES, 2 * OFFSETS + 1))
    shared = _tangent_shares(law, phase, dte, -OFFSETS, share)
    return {"approach": approach, "force": force, "share": share, "parts": parts, "shared": np.array(shared)}


def _travel(meshing: Pair, phase: Array) -> Array:
    """Distance (phases, offsets) [m] of each pair's contact behind the pitch point, along the line of action."""
    return (phase[:, None] - np.arange(-OFFSETS, OFFSETS + 1)) * meshing.base_pitch


def _compliances(rig: Rig, meshing: Pair, travel: Array) -> tuple[Array, Array, float, NDArray[np.bool_]]:
    """Compliance [m/N] of driver and driven tooth with the body below it, of their contact, and where they touch."""
    start, stop = meshing.active_driver
    wanted = meshing.rho_pitch[0] + travel
    rho = np.clip(wanted, start, stop)
    width = meshing.face_width
    # Most pairs are held at an end of the path of contact.
    places, which = np.unique(rho, return_inverse=True)
    one = tooth_compliance(meshing.driver, rig.driver.hub_radius, width, rig.material, places)
    two = tooth_compliance(meshing.driven, rig.driven.hub_radius, width, rig.material, meshing.line_of_action - places)
    inside = (wanted >= start) & (wanted <= stop)
    return (
        one.total[which].reshape(rho.shape),
        two.total[which].reshape(rho.shape),
        hertz_compliance(rig.material, width),
        inside,
    )


def _assemble(rig: Rig, meshing: Pair, approach: Array, force: Array, share: Array, parts: Array) -> MeshLaw:
    """The law with roll lengths, bending parts, backlash and mirror phase; columns that no pair uses left out.

    The bending part is that of tooth and body below it by the potential energy method, in the sum of both and their
    contact: finite elements do not separate bending from the rest of a pair's flexibility.
    """
    phase = np.arange(len(force)) / len(force)
    travel = _travel(meshing, phase)
    one, two, hertz, _ = _compliances(rig, meshing, travel)
    total = one + two + hertz
    used = np.flatnonzero(parts.any(axis=(0, 1)))
    # One more on either side: a pair passes from one column to the next where the cycle ends.
    keep = slice(max(int(used[0]) - 1, 0), int(used[-1]) + 2)
    rolled = involute(meshing.working_pressure_angle)
    thickness = (meshing.driven.psi_b - rolled) * meshing.driven.teeth / pi  # of the driven tooth, in pitches
    return MeshLaw(
        approach=approach,
        force=force,
        offsets=np.arange(-OFFSETS, OFFSETS + 1)[keep],
        share=share[:, keep],
        parts=parts[..., keep],
        rho1=(meshing.rho_pitch[0] + travel)[:, keep],
        rho2=(meshing.rho_pitch[1] - travel)[:, keep],
        bending=np.stack([one / total, two / total], axis=-1)[:, keep],
        backlash=max(meshing.backlash_normal, 0.0),
        base_pitch=meshing.base_pitch,
        mirror=(1.0 - thickness) % 1.0,
    )
