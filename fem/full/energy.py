"""Where the work of a step goes, term by term: an identity of the integrator, exact but for rounding.

Generalised-alpha balances M a + C v + K d = F at a weighted instant. Multiplied with the step's displacement it splits
without remainder into changes of energy, dissipation, and terms that vanish with the step squared: the scheme's own
loss (after Erlicher, Bonaventura and Bursi 2002, here with both weights). Energies are those of the motion beside the
steady rotation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.fem.contact.curve import lone_approach
from gearbench.fem.contact.law import contact_in
from gearbench.fem.full.contact import met_pairs
from gearbench.fem.full.machine import Machine, angles, hub_motions
from gearbench.fem.full.transient import Integrator, Motion, State, inertia

Array = NDArray[np.float64]


class Ledger(NamedTuple):
    """Work and energy [J] of a step: `work` of the torques; what it became: kinetic and elastic energy (of gears and
    supports), heat in supports and in the gears' material, work that the flanks took, `numerical` loss of the scheme,
    and `frame`: what the turning of the gears between supports that do not turn adds to the kinetic energy, which is
    the work of the Coriolis terms that are left out."""

    work: float
    kinetic: float
    elastic: float
    supports: float
    material: float
    flanks: float
    numerical: float
    frame: float

    @property
    def error(self) -> float:
        """Work that is not accounted for [J]."""
        became = self.kinetic + self.elastic + self.supports + self.material + self.flanks + self.numerical
        return self.work + self.frame - became


def product(one: Motion, two: Motion) -> float:
    """Sum of forces times displacements."""
    return float(one.hub @ two.hub + sum(np.vdot(x, y) for x, y in zip(one.gears, two.gears, strict=True)))


def _scaled(factor: float, x: Motion, other: float, y: Motion) -> Motion:
    return Motion(*(factor * one + other * two for one, two in zip(x, y, strict=True)))


def _elastic(machine: Machine, d: Motion) -> Motion:
    return Motion(machine.stiffness * d.hub, *(g.stiffness @ u for g, u in zip(machine.gears, d.gears, strict=True)))


def ledger(integrator: Integrator, before: State, after: State) -> Ledger:
    """The ledger of the step between two states."""
    machine, scheme = integrator.machine, integrator.scheme
    h, af = scheme.step, scheme.alpha_f
    tilt, shift = 0.5 - af, scheme.beta - 0.5 * scheme.gamma
    rigid = hub_motions(machine, angles(machine, before.d.hub, before.t))
    turned = hub_motions(machine, angles(machine, after.d.hub, after.t))
    moved = _scaled(1.0, after.d, -1.0, before.d)
    faster, jerk = _scaled(1.0, after.v, -1.0, before.v), _scaled(1.0, after.a, -1.0, before.a)
    mean = _scaled(0.5, after.v, 0.5, before.v)
    pulled, jerked = _elastic(machine, moved), inertia(machine, rigid, jerk)
    then, now = (0.5 * product(after.v, inertia(machine, hubs, after.v)) for hubs in (rigid, turned))
    outer, flanks = 0.5 * (after.outer + before.outer), 0.5 * (after.pressed + before.pressed)
    rise = after.outer - before.outer + after.pressed - before.pressed - machine.damping * faster.hub
    taken, risen = -float(moved.hub @ flanks), float(moved.hub @ rise)
    material = 0.0
    for i, gear in enumerate(machine.gears):
        at = moved.gears[i][gear.loaded]
        taken -= 0.5 * float(np.vdot(at, after.push[i] + before.push[i]))
        risen += float(np.vdot(at, after.push[i] - before.push[i]))
        risen -= machine.beta * float(np.vdot(pulled.gears[i], faster.gears[i]))
        material += machine.beta * float(np.vdot(pulled.gears[i], mean.gears[i]))
    numerical = h * tilt * product(mean, jerked) + h * shift * product(faster, jerked)
    numerical += h * h * shift * tilt * product(jerk, jerked) + tilt * (product(moved, pulled) - risen)
    return Ledger(
        work=float(moved.hub @ outer),
        kinetic=now - 0.5 * product(before.v, inertia(machine, rigid, before.v)),
        elastic=product(pulled, _scaled(0.5, after.d, 0.5, before.d)),
        supports=float(moved.hub @ (machine.damping * mean.hub)),
        material=material,
        flanks=taken,
        numerical=numerical,
        frame=now - then,
    )


def flank_energy(machine: Machine, state: State) -> float:
    """Energy [J] in what of the flanks' approach the mesh lacks: the integral of force over residual approach."""
    met, force = met_pairs(machine, state.pairs), state.force
    x, weight = np.polynomial.legendre.leggauss(30)
    x, weight = (x + 1) / 2, weight / 2
    total = 0.5 * float(force @ met.cross @ force)
    for p in np.flatnonzero(force > 0.0):
        contact, f = contact_in(met.pairs, p), float(force[p])
        curve = [lone_approach(machine.law.curves, contact, f * z * z)[0] for z in (1.0, *x)]
        total += f * curve[0] - f * float(np.array(curve[1:]) @ (2 * weight * x))
    return total
