"""Derivatives of all simulated lines by all unknowns, at one rig.

What teeth, the mesh's series, run-out and ripple do, and what holds the gears, is a small force at an unchanged
motion, carried through the rig's tangent (`bench.nonlinear.along`), many at once. Delays, gains and encoders act on the
channels alone. The rest (friction, the delay of the driven angle, structure that the rig does not have yet) is moved a
little and simulated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.bearing_nonlinearity import KEYS as BEARINGS
from gearbench.diagnosis.effects.coupling import KEY as COMPLIANCE
from gearbench.diagnosis.effects.eccentricity import KEYS as RUNOUTS
from gearbench.diagnosis.effects.encoder_runout import ADDS
from gearbench.diagnosis.effects.encoder_runout import KEYS as ENCODERS
from gearbench.diagnosis.effects.friction import KEY as FRICTION
from gearbench.diagnosis.effects.pitch_error import KEYS as PITCHES
from gearbench.diagnosis.effects.profile_error import FLANKS
from gearbench.diagnosis.effects.sensor_delay import KEYS as DELAYS
from gearbench.diagnosis.effects.tooth_crack import KEY as CRACK
from gearbench.diagnosis.effects.torque_ripple import KEY as RIPPLE
from gearbench.diagnosis.effects.torque_ripple import orders_in
from gearbench.diagnosis.forces.basis import waves
from gearbench.diagnosis.intake.signals import has_both_y
from gearbench.diagnosis.simulation.form import in_mesh_of_form
from gearbench.diagnosis.simulation.runout import in_mesh_of_runout, lobes_of, on_gears_of_runout, turn_of
from gearbench.diagnosis.simulation.target import Target
from gearbench.diagnosis.structure.contrast import CONTRAST, contrast_slope
from gearbench.diagnosis.structure.ends import UNEVEN, ends_slope, uneven_of
from gearbench.diagnosis.structure.layout import Layout, around_mesh
from gearbench.diagnosis.structure.rubbing import TURNING
from gearbench.diagnosis.structure.structure import GAIN, LATE, PHASE, SEAT, STRUCTURE, least_steps
from gearbench.diagnosis.structure.viscous import LOADED, damping_reference
from gearbench.lumped.nonlinear.coordinates import IN_MESH, U1, Acting
from gearbench.lumped.nonlinear.sensitive import LEAST_LEVEL

if TYPE_CHECKING:
    from gearbench.bench.nonlinear.along import Along
    from gearbench.lumped.nonlinear.model import NonLinear

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Real = NDArray[np.floating[Any]]
Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

# What holds the gears: by the difference between two rigs that are so far apart, in standard deviations as background.
AROUND, APART = ("stiffness", "damping", "mass", "inertia", *BEARINGS.values(), *STRUCTURE), 1e-3
# Moved and simulated, by this part of their standard deviation, where no difference between rigs says what they do: so
# are the lag of the drive and the delay of the driven angle, since a replay is given both channels. A compliant
# coupling twists at frequencies that samples do not hold; the zero of the mesh phase turns friction round with it.
FOLLOWED = DELAYS["angle_driven"]
MOVED, STEP = (FRICTION, TURNING, COMPLIANCE, *STRUCTURE, SEAT, LATE, FOLLOWED, PHASE), 0.05
# The same part where flanks part: over a longer one an impact that is met otherwise makes a jump.
SHORT_STEP = 2e-3
# Of those moved what hypotheses are weighed by, and what goes along with one: a late angle turns the mesh on as well.
WEIGHED = (FRICTION, TURNING, COMPLIANCE, FOLLOWED, PHASE)

# Samples times unknowns whose answers are held at a time, and unknowns at least.
AT_ONCE, FEWEST = 2**22, 32


class Other(NamedTuple):
    """A rig in which one unknown, by its number, is larger by `step`."""

    number: int
    step: float
    model: NonLinear


class Forces(NamedTuple):
    """Forces [N] per unit of unknowns, a departure each, and these unknowns' indices (departures,)."""

    acting: Acting
    at: Integers


def forces_of(
    layout: Layout, p: Array, along: Along, condition: str, chosen: Flags, others: Sequence[Other]
) -> Forces:
    """All forces that stand for the chosen unknowns (size,) along a motion of a record, of the rig of `p` (size,); what
    holds the gears by `others`."""
    parts, in_mesh = mesh_forces(layout, p, along, chosen)
    drive, on_drive = drive_forces(layout, along, condition)
    held = [*_leaning_forces(layout, along, chosen), *around_forces(along, others), *_nudged(layout, along, chosen)]
    used = chosen[on_drive]
    parts += [drive[:, used], *(force[:, None] for _, _, force in held)]
    values = np.empty((len(along.phase), sum(one.shape[1] for one in parts)), np.float32)
    at, of = np.unique([*in_mesh, *on_drive[used], *(index for index, _, _ in held)], return_inverse=True)
    on = np.array([*[IN_MESH] * len(in_mesh), *[along.drive] * int(used.sum()), *(on for _, on, _ in held)])
    return Forces(Acting(np.concatenate(parts, axis=1, out=values), on, of), at)


def pieces(forces: Forces, samples: int) -> Iterator[Forces]:
    """The forces piece by piece, so many unknowns at a time that what they do to a record of so many samples can be
    held in memory."""
    acting, most = forces.acting, max(AT_ONCE // samples, FEWEST)
    for first in range(0, len(forces.at), most):
        mine = (acting.of >= first) & (acting.of < first + most)
        values = acting.values if mine.all() else acting.values[:, mine]
        yield Forces(Acting(values, acting.on[mine], acting.of[mine] - first), forces.at[first : first + most])


def mesh_forces(layout: Layout, p: Array, along: Along, chosen: Flags) -> tuple[list[Real], Integers]:
    """Forces (entries, n) [N] per unit of the chosen unknowns (size,) that act in the mesh, group by group, and the
    unknowns' indices."""
    unknowns, law, phase = layout.unknowns, along.law, along.phase
    z1, z2 = layout.model.teeth
    parts: list[Real] = []
    at: list[int] = []

    def put(key: str, columns: Real) -> None:
        indices = unknowns.at(key)
        keep = chosen[indices]
        # As they are carried: of a long record all of them in double precision would fill the memory.
        parts.append(np.asarray(columns if keep.all() else columns[:, keep], dtype=np.float32))
        at.extend(indices[keep])

    numbers, bending = law.pairs(phase)[0], law.bending_of(phase)
    travel = (phase + along.ahead)[:, None] - numbers
    wave = waves(phase).T
    damped = (along.tangent.damping * along.rate)[:, None]
    loaded = along.model.rig.damping
    stiffer = along.elastic[:, None] + (0.5 + loaded.mesh_exponent) * damped
    put("scale", stiffer)
    if LOADED in unknowns.slices:
        about = damping_reference(loaded, layout.model)
        pressed = np.maximum(np.abs(along.elastic) / about, LEAST_LEVEL)
        put(LOADED, damped * np.log(pressed)[:, None])
    put("mesh-ratio", damped)
    mesh = along.model.rig.mesh
    put("curvature", stiffer * along.level[:, None] + 0.5 / (1.0 + mesh.exponent) * damped)
    series = 1.0 + _series_at(mesh.stiffness_cos, mesh.stiffness_sin, phase)
    put(CONTRAST, stiffer * contrast_slope(layout.tangents, float(p[unknowns[CONTRAST]][0]), along.sharing)[:, None])
    slopes = ends_slope(layout.ends, uneven_of(unknowns, p))
    for key, more, kept in zip(UNEVEN, layout.meshing.uneven(travel) / layout.ends.mean, slopes, strict=True):
        put(key, along.of_own_compliance(more)[:, None] + stiffer * kept)
    put("shape", stiffer * (wave / series[:, None]))
    put("profile", along.of_excess(wave))
    put(FLANKS, in_mesh_of_form(along, layout.meshing, travel))
    for side, key in enumerate(RUNOUTS.values()):
        put(key, in_mesh_of_runout(along, side))
    for side, (key, count, before) in enumerate(zip(PITCHES.values(), (z1, z2), (0, z1), strict=True)):
        tooth = numbers % count
        if chosen[unknowns.at(key)].any():
            put(key, _by_tooth(tooth, along.pair_stiffness, count))
        own = np.array([one for one in layout.teeth if before <= one < before + count], dtype=int)
        own = own[chosen[unknowns[CRACK].start + own]]
        if len(own):
            softer = _by_tooth(tooth, -along.pairs.force * bending[..., side], count)
            parts.append(softer[:, own - before])
            at.extend(unknowns[CRACK].start + own)
    return parts, np.array(at)


def _series_at(cosine: Sequence[float], sine: Sequence[float], phase: Array) -> Array:
    """A series in the mesh phase, of amplitudes at the orders 1, 2, .., at phases (n,) [cycles]."""
    turns = 2 * np.pi * np.arange(1, len(cosine) + 1)[:, None] * phase
    return np.asarray(np.asarray(cosine) @ np.cos(turns) + np.asarray(sine) @ np.sin(turns))


def _by_tooth(tooth: NDArray[np.int64], of_pairs: Array, count: int) -> NDArray[np.float32]:
    """What each tooth of a gear has (entries, count) of what its pairs have (entries, n_o) in the mesh, in the
    precision in which it is carried through the rig."""
    out = np.zeros((len(tooth), count), np.float32)
    rows = np.arange(len(tooth))
    for column in range(tooth.shape[1]):
        out[rows, tooth[:, column]] += of_pairs[:, column]
    return out


def _leaning_forces(layout: Layout, along: Along, chosen: Flags) -> list[tuple[int, int, Array]]:
    """Those of chosen run-outs on the gears, as `around_forces`."""
    out = []
    for side, key in enumerate(RUNOUTS.values()):
        indices = layout.unknowns.at(key)
        for on, force in on_gears_of_runout(along, side).items() if chosen[indices].any() else ():
            out += [(int(one), on, force[:, part]) for part, one in enumerate(indices) if chosen[one]]
    return out


def _nudged(layout: Layout, along: Along, chosen: Flags) -> list[tuple[int, int, Array]]:
    """What the driver's sensor changes of the motion that it is nudged towards, as `around_forces`."""
    nudge, unknowns = along.model.nudge, layout.unknowns
    if not nudge:
        return []
    indices = [*unknowns.at(DELAYS["angle_driver"]), *unknowns.at(ENCODERS["driver"])]
    rates = along.rate_of(np.column_stack([along.led, -lobes_of(turn_of(along, 0))])).T
    return [(int(one), U1, nudge * rate) for one, rate in zip(indices, rates, strict=True) if chosen[one]]


def around_forces(along: Along, others: Sequence[Other]) -> list[tuple[int, int, Array]]:
    """Index of the unknown, coordinate or mesh, and force (entries,) [N] per unit of what holds the gears."""
    out = []
    for one in others:
        out += [(one.number, on, force / one.step) for on, force in along.turned_into(one.model).items()]
    return out


def others_of(layout: Layout, p: Array, sd: Array, chosen: Flags) -> list[Other]:
    """The rigs around `p` (size,) in each of which one chosen unknown of what holds the gears is moved, by a part of
    its `sd` (size,), as far as they have the same coordinates as that of `p` and it has what is moved."""
    # Its time loop is compiled on import, which not every user of this module wants.
    from gearbench.lumped.nonlinear.model import nonlinear_model

    def model(values: Array) -> NonLinear:
        return nonlinear_model(around_mesh(layout, values), layout.meshing, layout.model.law)

    unknowns, here = layout.unknowns, model(p)
    low, high = unknowns.bounds()
    out, leasts = [], least_steps(unknowns)
    for key in AROUND:
        for index in unknowns.at(key):
            absent = 0.0 <= p[index] < leasts.get(key, 0.0)
            if absent or not chosen[index] or sd[index] <= 0.0:
                continue
            step = APART * sd[index]
            moved = p.copy()
            moved[index] += step if p[index] + step <= high[index] else -step
            if low[index] <= moved[index] and (other := model(moved)).like(here):
                out.append(Other(int(index), float(moved[index] - p[index]), other))
    return out


def drive_forces(layout: Layout, along: Along, condition: str) -> tuple[Array, Integers]:
    """Force (entries, columns) [N] on the driver's shaft per unit of ripple, and the unknowns' indices; none for a
    record that is no condition."""
    names = list(layout.torque_mean)
    if condition not in names:
        return np.zeros((len(along.phase), 0)), np.zeros(0, dtype=int)
    turn = turn_of(along, 0)
    columns = [part(order * turn) for order in orders_in(layout.unknowns) for part in (np.cos, np.sin)]
    first = layout.unknowns[RIPPLE].start + names.index(condition) * len(columns)
    return np.stack(columns, axis=1) / layout.model.base_radius[0], first + np.arange(len(columns))


def sensor_columns(
    layout: Layout, target: Target, number: int, channels: Mapping[str, Array]
) -> dict[int, dict[str, Complex]]:
    """Half-spectra (K,) of the changes of the channels (N,) of a record per unit of the unknowns of its sensors, by
    their index.

    That the gear turns otherwise where the driven angle's run-out is another shakes the rig a hundred times less.
    """
    unknowns, one = layout.unknowns, target.measurements[number]
    samples = one.phase.size
    omega = 2 * np.pi * np.fft.rfftfreq(samples, 1 / one.sampling_rate)
    g = layout.model.support_factor if has_both_y(one) else 0.0
    into = {"angle_driver": 1.0, "y_driver": g, "y_driven": -g}
    zero = np.zeros(omega.size, dtype=complex)
    found: dict[int, dict[str, Complex]] = {}
    for channel, key in DELAYS.items():
        if channel not in channels or key == FOLLOWED:
            continue
        late = -1j * omega * np.fft.rfft(channels[channel])
        if channel == "angle_driver":
            # It turns on while its sensor lags, which the fluctuation is without.
            late[0] = -layout.model.pitch_speed(one.mesh_frequency) * samples
        found[unknowns[key].start] = {channel: late, "dte": into[channel] * late}
    if "torque_driven" in channels:
        found[unknowns[GAIN].start] = {"torque_driven": np.fft.rfft(channels["torque_driven"])}
    for (side, key), teeth in zip(ENCODERS.items(), layout.model.teeth, strict=True):
        turn = 2 * np.pi * one.phase / teeth
        for part, wave in enumerate((np.cos, np.sin)):
            lines = np.fft.rfft(wave(turn))
            found[unknowns[key].start + part] = {f"angle_{side}": lines, "dte": ADDS[side] * lines}
    return {index: {name: parts.get(name, zero) for name in channels} for index, parts in found.items()}
