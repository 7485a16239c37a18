"""Jacobian of the force residuals: derivatives to the departures by hand, taken to the unknowns that move them.

Departures are linear in the unknowns, so no effect has a derivative of its own. Left out are friction's and the
filters' modulation of a column and, but for backlash, the change of the damping with the stiffness: below 3 % of a
column at the background's size. Steps that do not help are refused, so that this costs steps, not truth. With all of it
in, descents went further, into optima where supports and filters absorb friction, and verdicts on the calibration
family became worse: differences of the residuals, which have all of it in, are what the tests compare with, not what
the search uses.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.forces.basis import KNOTS
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.departures import Departures
from gearbench.diagnosis.forces.equations import DELAYED, SUPPORTS, Equation
from gearbench.diagnosis.forces.mesh import (
    Mesh,
    corrected,
    mesh,
    radial_impedance,
    softened,
    steady_rate,
    stiffness_factor,
)
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.residuals import (
    LEVER_OF,
    Residuals,
    assemble,
    carried_force,
    coupling_compliance,
    support_force,
    transform,
    yielding,
)
from gearbench.diagnosis.forces.unknowns import Unknowns

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

BACKLASH_STEP = 1e-11  # [m]; beyond a nanometre samples cease to touch


@dataclass(frozen=True)
class Linearised:
    """Residuals in B used bins under `departures`, with the `spectra` (N/2 + 1,) of the channels and the mesh that they
    make, their Jacobian (4, B, unknowns), and that (B, unknowns) of the mesh force."""

    departures: Departures
    spectra: Mapping[str, Complex]
    mesh: Mesh
    residuals: Residuals
    jacobian: Complex
    mesh_jacobian: Complex


def linearised(
    model: NominalModel, condition: Condition, unknowns: Unknowns, p: Array, used: NDArray[np.int64]
) -> Linearised:
    """The residuals about the unknowns `p` (size,) in the B `used` bins."""
    departures = unknowns.departures(p, condition)
    spectra = corrected(condition, departures)
    state = mesh(model, condition, departures, spectra)
    residuals = assemble(model, condition, departures, spectra, state)
    carried = carried_force(model, condition, departures, state.force)
    at = _Point(model, condition, departures, spectra, state, carried, residuals)
    out = np.zeros((len(Equation), len(used), unknowns.size), dtype=complex)
    entries, moved = _mesh_columns(at, unknowns, used)
    mesh_jacobian = np.zeros((len(used), unknowns.size), dtype=complex)
    np.add.at(mesh_jacobian.T, entries, moved)
    # One error of the mesh force shows in every equation, as strongly as it enters there.
    columns = np.unique(entries)
    out[:, :, columns] = -residuals.mesh_factor[:, used, None] * mesh_jacobian[:, columns]
    put = _Put(out, used, unknowns)
    _support_columns(at, put)
    _drive_columns(at, put)
    _friction_columns(at, put)
    return Linearised(departures, spectra, state, residuals.at(used), out, mesh_jacobian)


@dataclass(frozen=True)
class _Point:
    """Where the Jacobian is taken."""

    model: NominalModel
    condition: Condition
    departures: Departures
    spectra: Mapping[str, Complex]
    mesh: Mesh
    carried: Complex
    residuals: Residuals


@dataclass(frozen=True)
class _Put:
    """Adds a spectrum (K,) to the columns of all unknowns that move an element of a slot, in one equation."""

    out: Complex
    used: NDArray[np.int64]
    unknowns: Unknowns

    def __call__(self, equation: Equation, slot: str, element: int, spectrum: Complex) -> None:
        for entry in self.unknowns.moving.get((slot, element), ()):
            self.out[equation, :, entry] += spectrum[self.used]


def _mesh_columns(at: _Point, unknowns: Unknowns, used: NDArray[np.int64]) -> tuple[list[int], Complex]:
    """What moves the mesh force: entries (n,), some more than once, and spectra (n, B) of what each adds to the
    derivatives of F_m, the same everywhere."""
    listed: list[tuple[int, Array]] = []
    for slot, derivatives in _mesh_slots(at):
        for element, value in derivatives.items():
            listed.extend((entry, value) for entry in unknowns.moving.get((slot, element), ()))
    for slot, tangent in (("excess", at.mesh.working_tangent), ("closed", at.mesh.tangent)):
        for one in unknowns.based(slot):
            assert one.basis is not None
            start = unknowns[one.key].start
            listed.extend((start + i, tangent * wave) for i, wave in enumerate(one.basis(at.condition)))
    turned = unknowns.moved_besides("turned")
    turning = _turning(at) if turned else np.zeros(0)
    for own, basis in turned:
        listed.extend((own.start + i, turning * wave) for i, wave in enumerate(basis(at.condition)))
    entries = [entry for entry, _ in listed]
    values = np.fft.rfft(np.stack([value for _, value in listed]), axis=-1)[:, used] / at.condition.samples
    return entries, np.asarray(values)


def _mesh_slots(at: _Point) -> Iterator[tuple[str, dict[int, Array]]]:
    """Derivatives (N,) of the mesh force in time to the elements of every slot that moves it."""
    state, condition = at.mesh, at.condition
    viscous = state.viscosity * state.rate * state.touching
    level = np.maximum(np.abs(state.elastic), 1e-3 * condition.force_level) / at.model.reference_force
    yield "scale", {0: state.elastic + 0.5 * viscous}
    yield "mesh_ratio", {0: viscous}
    yield "dissipation", {0: np.abs(state.rate) * state.rate * state.touching}
    yield "offset", {0: state.working_tangent}
    yield "shape", dict(enumerate(state.elastic * condition.waves))
    yield "profile", dict(enumerate(state.working_tangent * condition.waves))
    yield "curvature", {0: state.elastic * np.log(level)}
    yield "backlash", {0: _backlash(at)}
    yield "radial", dict(enumerate(_radial(at)))
    yield "yielding", dict(enumerate(_yielding(at)))
    yield "delay", dict(_delays(at))
    pitch, loss = _teeth(condition, at.departures.loss, state)
    yield "pitch", dict(enumerate(pitch))
    yield "loss", dict(enumerate(loss))


def _radial(at: _Point) -> Array:
    condition, n = at.condition, at.condition.samples
    impedance, spring, damper = radial_impedance(at.model, condition, at.departures)
    softening = at.model.transverse_factor**2 * condition.force_full / impedance**2
    changes = np.concatenate([softening * spring[:, None], softening * damper])
    return np.asarray(at.mesh.tangent * (np.fft.irfft(changes, n, axis=-1) * n))


def _yielding(at: _Point) -> Array:
    condition, n = at.condition, at.condition.samples
    bins = np.zeros((2 * len(KNOTS), n // 2 + 1), dtype=complex)
    bins[: len(KNOTS)] = condition.hats_full * condition.force_full / condition.stiffness_level
    bins[len(KNOTS) :] = 1j * bins[: len(KNOTS)]
    return np.asarray(at.mesh.tangent * (np.fft.irfft(bins, n, axis=-1) * n))


def _delays(at: _Point) -> Iterator[tuple[int, Array]]:
    condition, state, n, g = at.condition, at.mesh, at.condition.samples, at.model.support_factor
    braking = (state.viscosity + 2 * at.departures.dissipation * np.abs(state.rate)) * state.touching
    for number, (channel, sign) in enumerate(zip(DELAYED, (1.0, -1.0, g, -g), strict=True)):
        if channel in at.spectra:
            rate = 1j * condition.omega * at.spectra[channel]
            faster = np.fft.irfft(1j * condition.omega * rate, n) * n
            rate[0] = steady_rate(condition, channel)
            yield number, sign * (state.tangent * (np.fft.irfft(rate, n) * n) + braking * faster)


def _teeth(condition: Condition, loss: Array, state: Mesh) -> tuple[Array, Array]:
    """Derivatives (z1 + z2, N) of the mesh force to each tooth's pitch error and to its loss of bending stiffness."""
    soft = softened(condition, loss)
    left = (condition.load_share * soft).sum(axis=-1)
    weaker = (condition.load_share * soft**2)[..., None] * condition.bending
    both = np.stack([condition.load_share, condition.load_share], axis=-1)
    pitch = _of_teeth(condition, both * state.working_tangent[:, None, None])
    own = (1.0 - loss[:, None]) ** -2
    return pitch, own * _of_teeth(condition, weaker * (-state.elastic / left)[:, None, None])


def _of_teeth(condition: Condition, weights: Array) -> Array:
    """Weights (N, n_o, 2) of the pairs sorted to their teeth: (z1 + z2, N)."""
    z1, z2 = condition.teeth
    total = np.zeros((z1 + z2, condition.samples))
    at = np.arange(condition.samples)
    for pair in range(weights.shape[1]):
        total[condition.tooth[0][:, pair], at] += weights[:, pair, 0]
        total[z1 + condition.tooth[1][:, pair], at] += weights[:, pair, 1]
    return total


def _backlash(at: _Point) -> Array:
    """As a difference, of the damping too: flanks that hardly touch have most of their force from it."""
    law, phase = at.model.hardened, at.condition.phase + at.departures.turned
    present = max(law.backlash + at.departures.backlash, 0.0)
    if not np.any(at.mesh.delta < at.mesh.filled - present):
        return np.zeros(at.condition.samples)
    factor = at.model.scale * stiffness_factor(at.condition, at.departures)
    ratio = at.model.mesh_ratio * np.exp(at.departures.mesh_ratio)

    def carried(backlash: float) -> Array:
        force, slope = replace(law, backlash=backlash).evaluate(at.mesh.delta, phase, at.mesh.filled)
        viscosity = 2 * ratio * np.sqrt(np.maximum(factor * slope, 0.0) * at.model.mesh_mass)
        return np.asarray(factor * force + viscosity * at.mesh.rate * at.mesh.touching)

    return (carried(present + BACKLASH_STEP) - carried(present)) / BACKLASH_STEP


def _turning(at: _Point) -> Array:
    """What the elastic force grows by (N,) [N/cycle] as the mesh turns on, between two rows of its law."""
    law, phase = at.model.hardened, at.condition.phase + at.departures.turned
    row = np.floor(phase * law.phases)
    ahead, behind = (law.evaluate(at.mesh.delta, one / law.phases, at.mesh.filled)[0] for one in (row + 1, row))
    factor = at.model.scale * stiffness_factor(at.condition, at.departures)
    return np.asarray(factor * (ahead - behind) * law.phases)


def _support_columns(at: _Point, put: _Put) -> None:
    """Both supports, and the direct part of a late displacement."""
    model, departures, n, k = at.model, at.departures, at.condition.samples, at.condition.bins
    g, s = model.support_factor, 1j * at.condition.omega[:k]
    for one in SUPPORTS:
        if one.channel not in at.spectra:
            continue
        y, side, sign = at.spectra[one.channel], one.side, one.sign
        values = support_force(model, side, np.fft.irfft(y, n) * n, departures)
        spring, hardening = np.fft.rfft(np.stack(values), axis=-1)[:, :k] / n
        damping = model.damping[side] * np.exp(departures.damping[side])
        put(one.equation, "stiffness", side, sign * spring / g)
        put(one.equation, "exponent", side, sign * hardening / g)
        put(one.equation, "damping", side, sign * damping * s * y[:k] / g)
        put(one.equation, "mass", side, sign * model.mass[side] * s**2 * y[:k] / g)
        mass = model.mass[side] * (1 + departures.mass[side])
        moving = (mass * s**2 + damping * s) * y[:k] + spring
        put(one.equation, "delay", DELAYED.index(one.channel), sign * s * moving / g)


def _drive_columns(at: _Point, put: _Put) -> None:
    """Inertias, coupling, torque at the drive and the direct part of late angles."""
    model, departures, k = at.model, at.departures, at.condition.bins
    rb1, rb2 = model.base_radius
    s = 1j * at.condition.omega[:k]
    factor = at.residuals.mesh_factor[Equation.DRIVE]
    turning = s**2 * at.spectra["angle_driver"][:k] / rb1
    inertia = model.inertia[0] * (1 + departures.inertia[0])
    rotor = model.rotor * (1 + departures.inertia[2])
    shaft = inertia * turning + rb1 * at.carried[Equation.DRIVE]
    soft = coupling_compliance(model, at.condition, departures)
    late = DELAYED.index("angle_driver")
    put(Equation.DRIVE, "inertia", 0, -factor * model.inertia[0] * turning / rb1)
    put(Equation.DRIVE, "inertia", 2, -model.rotor * (turning + s**2 * soft * shaft) / rb1)
    put(Equation.DRIVE, "coupling", 0, -rotor * s**2 * yielding(model, at.condition.omega[:k]) * shaft / rb1)
    put(Equation.DRIVE, "delay", late, -(rotor + factor * inertia) * s * turning / rb1)
    for one in put.unknowns.based("torque"):
        assert one.basis is not None
        columns = one.basis(at.condition)[:, put.used] / rb1
        put.out[Equation.DRIVE, :, put.unknowns[one.key]] += columns.T
    if "torque_driven" in at.spectra:
        moving = model.inertia[1] * s**2 * at.spectra["angle_driven"][:k] / rb2
        put(Equation.LOAD, "inertia", 1, moving / rb2)
        late = DELAYED.index("angle_driven")
        put(Equation.LOAD, "delay", late, (1 + departures.inertia[1]) * s * moving / rb2)


def _friction_columns(at: _Point, put: _Put) -> None:
    """Friction, levers, and the smooth filters of single equations."""
    condition, k, n = at.condition, at.condition.bins, at.condition.samples
    rubbing = np.fft.rfft(at.mesh.force * condition.lever_arms, axis=-1)[:, :k] / n
    turned = [
        (entries, transform(condition, at.mesh.force * basis(condition))[..., put.used])
        for entries, basis in put.unknowns.moved_besides("levers")
    ]
    for equation in Equation:
        factor = at.residuals.mesh_factor[equation]
        for entries, spectra in turned:
            put.out[equation, :, entries] -= (factor[put.used] * spectra[:, LEVER_OF[equation]]).T
        put(equation, "friction", 0, -factor * rubbing[LEVER_OF[equation]])
        weighted = condition.hats_full[:, :k] * (factor * at.carried[equation])
        first = int(equation) * 2 * len(KNOTS)
        for knot, spectrum in enumerate(weighted):
            put(equation, "filters", first + knot, spectrum)
            put(equation, "filters", first + len(KNOTS) + knot, 1j * spectrum)
