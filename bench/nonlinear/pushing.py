"""The mesh along a motion, instant by instant: what it carries and how that changes with deflection, rate and phase."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.nonlinear.fine import Motion
from gearbench.bench.nonlinear.replay import Steady
from gearbench.bench.nonlinear.run import Setup
from gearbench.lumped.nonlinear.model import NonLinear
from gearbench.lumped.nonlinear.pressing import Instants, of_pairs, pressed, turning
from gearbench.lumped.nonlinear.rubbing import rubbed_along
from gearbench.lumped.nonlinear.sensitive import sensitivities
from gearbench.lumped.nonlinear.tables import Table, instants

Array = NDArray[np.float64]


class Pushing(NamedTuple):
    """Arrays (instants, ...) of `bench.nonlinear.along.Along` and of its `Tangent`."""

    elastic: Array
    pair_force: Array
    pair_tangent: Array
    form: Array
    own: Array
    rate: Array
    level: Array
    sharing: Array
    stiffer: Array
    stiffness: Array
    damping: Array
    turning: Array
    rubbed: Array
    ahead: Array


def stepped(steady: Steady, substeps: int) -> Setup:
    """The setup of a motion with so many steps per sample."""
    return replace(steady.setup, substeps=substeps, table=None)


def pushing(steady: Steady, motion: Motion, substeps: int) -> Pushing:
    """The mesh along a motion at the half steps of so many steps per sample."""
    setup = stepped(steady, substeps)
    model, travel, count = setup.model, motion.travel, len(motion.travel)
    table = setup.table_for(0, len(steady.outputs))
    turned = table.position[:count] / model.law.phases + motion.turned
    cycles = np.floor(turned)
    turned = np.minimum(turned - cycles, 1.0 - 1e-12)
    first = table.first_pair[:count] + cycles
    at = instants(model, table._replace(position=turned * model.law.phases, first_pair=first), count)
    whole = pressed(model.law, at, travel)
    force, slope = whole
    # Back flanks close at the rate of the deflection alone.
    closing = motion.rate + np.where(force < 0.0, 0.0, table.excess_rate[:count])

    def force_at(there: Instants) -> Array:
        elastic, tangent = pressed(model.law, there, travel)
        return np.asarray(elastic + _damping(model, elastic, tangent) * closing)

    onward, slope = turning(model.law, at, force_at), np.maximum(slope, 0.0)
    damping = _damping(model, force, slope)
    # Flanks that part faster than they spring back push no more.
    idle = (force + damping * closing) * force <= 0.0
    force, slope, damping, onward = (np.where(idle, 0.0, one) for one in (force, slope, damping, onward))
    # Damping that grows with the force is the stiffer for being pressed while the flanks close.
    stiffer = 1.0 + model.rig.damping.mesh_exponent * damping * closing / np.where(idle, 1.0, force)
    mesh = model.rig.mesh
    answer = sensitivities(model.law, at, travel, whole, mesh.exponent, mesh.reference_force)
    stiffness = slope * stiffer + _met(damping, force, closing, setup.step / 2)
    nominal = setup.phases(0, count)
    whole_turns = np.round(nominal - turned)
    another = whole_turns - np.floor(nominal)
    pairs = (_numbered(one, another) for one in (*of_pairs(model.law, at, travel), answer.form, answer.own))
    pair_force, pair_tangent, form, own = (np.where(idle[:, None], 0.0, one) for one in pairs)
    rubbed = _rubbed(setup, table, motion, turned * model.law.phases)
    return Pushing(
        force, pair_force, pair_tangent, form, own, closing, answer.level, answer.sharing, stiffer, stiffness, damping,
        onward, rubbed, turned + whole_turns - nominal,
    )  # fmt: skip


def _numbered(values: Array, ahead: Array) -> Array:
    """What pairs have (instants, n_o) in the columns of the nominal rotation's cycle, of a mesh that is turned into the
    cycle `ahead` (instants,), 1, or behind, -1."""
    out = values.copy()
    for cycles, here, there in ((1, slice(1, None), slice(None, -1)), (-1, slice(None, -1), slice(1, None))):
        rows = ahead == cycles
        out[rows] = 0.0
        out[rows, here] = values[rows, there]
    return out


def _damping(model: NonLinear, elastic: Array, tangent: Array) -> Array:
    return model.viscosity(np.maximum(tangent, 0.0), np.abs(elastic))


def _met(damping: Array, force: Array, closing: Array, apart: float) -> Array:
    """Stiffness (instants,) [N/m] of flanks that have met since the instant before, `apart` [s]: their damping begins
    with a jump, which comes the earlier the deeper they are, by one over the rate of closing."""
    met = (np.roll(damping, 1) == 0.0) & (damping > 0.0) & (closing * force > 0.0)
    return np.where(met, damping / apart, 0.0)


def _rubbed(setup: Setup, table: Table, motion: Motion, position: Array) -> Array:
    """What friction adds to the direction of a force in the mesh (instants, n) along a motion, at positions (instants,)
    in rows of the mesh law."""
    count = len(position)
    if setup.model.rig.friction.coefficient == 0.0:
        return np.zeros((count, setup.model.size))
    pace = table.pace[:count] if table.pace.size else np.ones(count)
    return rubbed_along(setup.model, position, pace, motion.rates, setup.mesh_frequency)
