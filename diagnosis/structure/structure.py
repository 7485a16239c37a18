"""Structure of real rigs that a nominal case leaves out, as unknowns around "nearly none": supports that yield across
their direction and couple both, a housing behind them, sensor gain. What holds the load is none of them: the
driven gear turns as it was measured.

Every unknown is a ratio to numbers of the nominal rig (compliance over compliance, logarithm of a frequency over that
of the supports), so that priors hold for rigs of any size.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, exp, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.coupling import KEY as COMPLIANCE
from gearbench.diagnosis.effects.coupling import LOSS, is_stated
from gearbench.diagnosis.effects.effect import SIDES, changed
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.diagnosis.structure.contrast import CONTRAST, CONTRAST_NAME
from gearbench.diagnosis.structure.ends import ENDS, ENDS_NAME, TILT, TILT_NAME
from gearbench.diagnosis.structure.rubbing import TURNING, TURNING_NAME
from gearbench.diagnosis.structure.viscous import LOADED, LOADED_NAME
from gearbench.diagnosis.verdict import NINE_OF_TEN, Found
from gearbench.rig import Across, Housing, Rig, Rocking

Array = NDArray[np.float64]

# Compliance of a support across over that along: bearings are several times stiffer across than pedestals along, and
# where both stand on rolling bearings alone they yield nearly alike.
ACROSS, ACROSS_SD, ACROSS_LARGEST = "across", 0.3, 1.5
# Stiffness that couples both directions over the root of their product: asymmetric pedestals have a tenth.
CROSS, CROSS_SD, CROSS_LARGEST = "cross", 0.1, 0.7
# Logarithm of its damping over that of the same loss factor as along, by the root of both stiffnesses.
DAMPED, DAMPED_SD, DAMPED_LARGEST = "across-damping", 0.5, 2.0
# Housing: compliance over the supports' mean one (half a per cent to ten are usual), logarithms of its frequency over
# that of a gear on its support, and of its damping ratio over a twentieth.
HOUSING, HOUSING_SD, HOUSING_LARGEST = "housing", 0.04, 0.5
MODE, MODE_SD, MODE_LARGEST, HOUSING_RATIO = "housing-mode", 0.7, 3.0, 0.05
# It has two motions: as a rule it moves along both supports, and it rocks, which is what the mesh pushes at; but both
# may be of one kind. The angle whose cosine and sine are to each other as the shares of driver's and driven support: an
# eighth of a turn where they are equal, and what departs, by a quarter of one into the other kind.
MOTIONS = ("along", "rocking")
SHAPE, SHAPE_SD, SHAPE_LARGEST = "housing-shape", pi / 4, 3 * pi / 4
EQUAL = (pi / 4, -pi / 4)
# Shares across of either motion, over the root mean square of those along: few housings move along alone.
OBLIQUE, OBLIQUE_SD, OBLIQUE_LARGEST = "housing-across", 0.5, 2.0
# Part of the supports' motion with the housing that displacement sensors make: most stand on the ground, some on it.
SEAT, SEAT_SD = "seat", 0.5
# Gain of the reaction's sensor: torque sensors are good to a few tenths of a per cent, their mounting to one.
GAIN, GAIN_SD = "gain", 0.01
# Mesh phase [cycles] that the encoders show at that of the gears: zeros are set by a tooth that touches, not better
# than this.
PHASE, PHASE_SD, PHASE_LARGEST = "phase", 0.01, 0.05
# Time [s] by which the torque reaches the rotor after its channel shows it, in periods of the mesh's resonance: filters
# and shafts are between both, a little more than between channels of one clock.
LATE, LATE_SD = "drive-late", 0.015
# Of a coupling's loss factor, whose logarithm is taken: steel discs have a fiftieth, rubber a tenth.
LOSS_SD, LOSS_LARGEST = 0.6, 3.0
# Softer than the former part a rig has it, and then at least the latter: steps stay long.
FELT, STIFFEST = 0.01, 0.03
# Moved from nothing by the least that a rig feels: a smaller step would show no derivative, and a fit that begins
# without it would never find it.
LEAST_STEP: Mapping[str, float] = {ACROSS: STIFFEST, HOUSING: 0.05 * HOUSING_SD}
# Part of the hypothesis' prior below which a coupling's compliance is left out of the rig, its resonance ten times the
# mesh's: every step of a replay would have to follow what no line shows.
NEARLY_RIGID = 4e-3
NONE = 1e-4  # compliance of a housing below which there is none
# What holds the gears beside the nominal rig's supports.
STRUCTURE = (ACROSS, CROSS, DAMPED, HOUSING, MODE, SHAPE, OBLIQUE, LOSS)
# The housing as a rig has it.
HOUSED = (HOUSING, MODE, SHAPE, OBLIQUE, SEAT)
# What is told of the structure that was found.
NAMES = (
    (ACROSS, "support compliance across over along", "1"),
    (CROSS, "support cross-coupling over root of both stiffnesses", "1"),
    (HOUSING, "housing compliance over the supports'", "1"),
    (SEAT, "part of the housing's motion that the displacement sensors make", "1"),
    (GAIN, "gain of the reaction torque (logarithm)", "1"),
    (PHASE, "zero of the mesh phase in cycles", "1"),
    (LATE, "lag of the drive's torque behind its channel", "s"),
    (LOADED, LOADED_NAME, "1"),
    (TURNING, TURNING_NAME, "1"),
    (CONTRAST, CONTRAST_NAME, "1"),
    (ENDS, ENDS_NAME, "1"),
    (TILT, TILT_NAME, "1"),
)
# Where a fit begins with them: below some per cent a rig does not show them.
ACROSS_BEGIN, HOUSING_BEGIN = 0.15, 0.04


def structure_groups(rig: Rig, model: NominalModel) -> list[Group]:
    """The unknowns of what the nominal rig does not say of its structure."""
    groups = [
        group(ACROSS, "1", SIDES, ACROSS_SD, slot="structure", low=0.0, high=ACROSS_LARGEST),
        group(CROSS, "1", SIDES, CROSS_SD, slot="structure", first=4, low=-CROSS_LARGEST, high=CROSS_LARGEST),
        group(DAMPED, "1", SIDES, DAMPED_SD, slot="structure", first=25, low=-DAMPED_LARGEST, high=DAMPED_LARGEST),
        group(GAIN, "1", ("torque_driven",), GAIN_SD, slot="structure", first=2),
        group(PHASE, "1", ("mesh",), PHASE_SD, slot="structure", first=18, low=-PHASE_LARGEST, high=PHASE_LARGEST),
        group(LATE, "s", ("torque_driver",), LATE_SD / model.resonance, slot="structure", first=19),
        group(LOSS, "1", ("coupling",), LOSS_SD, slot="structure", first=26, low=-LOSS_LARGEST, high=LOSS_LARGEST),
    ]
    if rig.housing is None:
        groups.append(group(HOUSING, "1", MOTIONS, HOUSING_SD, slot="structure", first=10, low=0.0,
                            high=HOUSING_LARGEST))  # fmt: skip
        modes = [f"{one}.{part}" for one in MOTIONS for part in ("frequency", "damping")]
        groups.append(group(MODE, "1", modes, MODE_SD, slot="structure", first=12, low=-MODE_LARGEST,
                            high=MODE_LARGEST))  # fmt: skip
        groups.append(group(SHAPE, "rad", MOTIONS, SHAPE_SD, slot="structure", first=16, low=-SHAPE_LARGEST,
                            high=SHAPE_LARGEST))  # fmt: skip
        shares = [f"{one}.{side}" for one in MOTIONS for side in SIDES]
        groups.append(group(OBLIQUE, "1", shares, OBLIQUE_SD, slot="structure", first=21, low=-OBLIQUE_LARGEST,
                            high=OBLIQUE_LARGEST))  # fmt: skip
        groups.append(group(SEAT, "1", ("displacements",), SEAT_SD, slot="structure", first=20, low=0.0, high=1.0))
    return groups


def beginnings(unknowns: Unknowns, p: Array) -> list[Array]:
    """`p` (size,) without and with centres that move across their supports."""
    moving = p.copy()
    moving[unknowns[ACROSS]] = ACROSS_BEGIN
    return [p, moving]


def otherwise(unknowns: Unknowns, p: Array) -> Array | None:
    """`p` (size,) with the structure that a fit does not walk to from there: supports that yield across where they are
    rigid; None where they are not."""
    if ACROSS not in unknowns.slices or p[unknowns[ACROSS]].max() > STIFFEST:
        return None
    trial = p.copy()
    trial[unknowns[ACROSS]] = ACROSS_BEGIN
    return trial


def housings(unknowns: Unknowns, p: Array) -> list[Array]:
    """`p` (size,), and the same with one more motion of the housing, of either kind at several frequencies."""
    out = [p]
    if HOUSING not in unknowns.slices:
        return out
    for motion, kind in free_motions(unknowns, p):
        out += [with_motion(unknowns, p, motion, at, HOUSING_BEGIN, kind) for at in (-1.0, -0.5, 0.0, 0.5)]
    return out


def least_steps(unknowns: Unknowns) -> Mapping[str, float]:
    """Least that a rig feels of each group, by its key, that it need not have."""
    least = dict(LEAST_STEP)
    if COMPLIANCE in unknowns.slices and not is_stated(unknowns):
        least[COMPLIANCE] = NEARLY_RIGID * float(unknowns.group(COMPLIANCE).wide[0])
    return least


def free_motions(unknowns: Unknowns, p: Array) -> list[tuple[int, int]]:
    """Motions that `p` (size,) has not, each with the kinds that it may be of: as it is called where there is none."""
    there = p[unknowns[HOUSING]] > NONE
    if not there.any():
        return [(kind, kind) for kind in range(len(MOTIONS))]
    return [(int(motion), kind) for motion in np.flatnonzero(~there) for kind in range(len(MOTIONS))]


def with_motion(unknowns: Unknowns, p: Array, motion: int, frequency: float, compliance: float, kind: int) -> Array:
    """`p` (size,) with a motion of the housing of that compliance and logarithm of the frequency, of a kind (its number
    among MOTIONS) and with equal shares."""
    out = p.copy()
    out[unknowns[HOUSING].start + motion] = compliance
    out[unknowns[MODE].start + 2 * motion] = frequency
    out[unknowns[SHAPE].start + motion] = EQUAL[kind] - EQUAL[motion]
    return out


def held(rig: Rig, model: NominalModel, unknowns: Unknowns, p: Array) -> Rig:
    """The rig with its supports across and its housing."""
    soft, cross, damped = (p[unknowns[key]] for key in (ACROSS, CROSS, DAMPED))
    supports = {}
    for number, side in enumerate(SIDES):
        support = getattr(rig.support, side)
        if support.across is None and soft.max() > FELT and support.stiffness is not None:
            along, ratio = support.stiffness, 1.0 / max(float(soft[number]), STIFFEST)
            across = Across(
                stiffness=along * ratio,
                damping=support.damping * ratio**0.5 * exp(float(damped[number])),
                coupling=float(cross[number]) * along * ratio**0.5,
            )
            support = support.model_copy(update={"across": across})
        supports[side] = support
    rig = changed(rig, "support", **supports)
    if HOUSING in unknowns.slices and p[unknowns[HOUSING]].max() > NONE:
        compliance, modes, shapes, oblique, seat = (p[unknowns[key]] for key in HOUSED)
        # What does not move across its support is not moved across by a housing either.
        free = [getattr(rig.support, side).across is not None for side in SIDES]
        housing = housing_of(model, compliance, modes, shapes, np.where(free * len(MOTIONS), oblique, 0.0), seat)
        rig = rig.model_copy(update={"housing": housing})
    return rig


def housing_of(
    model: NominalModel, compliance: Array, modes: Array, shapes: Array, oblique: Array, seat: Array
) -> Housing:
    """The housing of compliances (2,), frequencies and dampings (4,), shapes (2,), shares across (4,) and the sensors'
    seat (1,) as unknowns, one compliance at least above `NONE`."""
    mean, pace = mean_stiffness(model), pace_of(model)
    motions = []
    for number in np.flatnonzero(compliance > NONE):
        frequency, damping = (float(value) for value in modes[2 * number : 2 * number + 2])
        stiffness, omega = mean / float(compliance[number]), pace * exp(frequency)
        mass, angle = stiffness / omega**2, EQUAL[number] + float(shapes[number])
        motions.append(
            {
                "mass": mass,
                "stiffness": stiffness,
                "damping": 2 * HOUSING_RATIO * exp(damping) * omega * mass,
                "driver_share": sqrt(2) * cos(angle),
                "driven_share": sqrt(2) * sin(angle),
                "driver_share_across": float(oblique[2 * number]),
                "driven_share_across": float(oblique[2 * number + 1]),
            }
        )
    rocking = Rocking(**motions[1]) if len(motions) > 1 else None
    return Housing(**motions[0], sensor_share=float(seat[0]), rocking=rocking)


def pace_of(model: NominalModel) -> float:
    """Angular frequency [rad/s] of a gear on its support, that of a housing is told by: of the means of both."""
    return sqrt(mean_stiffness(model) / (0.5 * (model.mass[0] + model.mass[1])))


def mean_stiffness(model: NominalModel) -> float:
    """Stiffness [N/m] of the mean compliance of both supports."""
    return 2.0 / (1.0 / model.stiffness[0] + 1.0 / model.stiffness[1])


def seated(unknowns: Unknowns, p: Array) -> Array:
    """`p` (size,) with displacement sensors that stand on the housing."""
    out = p.copy()
    out[unknowns[SEAT]] = 1.0
    return out


def sensed(rig: Rig, model: NominalModel, unknowns: Unknowns, p: Array, delays: Mapping[str, str]) -> Rig:
    """The rig with its sensors' delays and gain, and its zero of the mesh phase."""
    sensors, update = rig.sensors, {}
    for channel, key in delays.items():
        field = f"delay_{channel}"
        update[field] = getattr(sensors, field) + float(p[unknowns[key]][0])
    update["gain_torque_driven"] = sensors.gain_torque_driven * exp(float(p[unknowns[GAIN]][0]))
    update["delay_torque_driver"] = sensors.delay_torque_driver - float(p[unknowns[LATE]][0])
    update["mesh_phase_zero"] = sensors.mesh_phase_zero + float(p[unknowns[PHASE]][0])
    return changed(rig, "sensors", **update)


def lag_of_drive(unknowns: Unknowns, p: Array) -> tuple[float, float]:
    """Time [s] by which the torque reaches the rotor after its channel shows it, and its standard deviation on sound
    rigs."""
    return float(p[unknowns[LATE]][0]), float(unknowns.group(LATE).sd[0])


def structure_found(unknowns: Unknowns, p: Array, std: Array) -> tuple[Found, ...]:
    """What stands out of the structure (beyond two standard deviations), each with its 90 % interval."""
    out = []
    for key, name, unit in NAMES:
        if key not in unknowns.slices:
            continue
        for index, part in enumerate(unknowns.group(key).names):
            at = unknowns[key].start + index
            if abs(p[at]) > 2.0 * std[at] > 0.0:
                reach = NINE_OF_TEN * std[at]
                kind = kind_of(unknowns, p, index) if key == HOUSING else part
                out.append(Found(name=_named(kind, name), value=float(p[at]),
                                 low=float(p[at] - reach), high=float(p[at] + reach), unit=unit))  # fmt: skip
    return tuple(out)


def kind_of(unknowns: Unknowns, p: Array, motion: int) -> str:
    """Which of MOTIONS a motion is by its shares."""
    angle = EQUAL[motion] + float(p[unknowns[SHAPE]][motion])
    return MOTIONS[0 if cos(angle) * sin(angle) > 0.0 else 1]


def _named(part: str, name: str) -> str:
    if part in MOTIONS:
        return f"{name}, where it {'rocks' if part == 'rocking' else 'moves along'}"
    return f"{part}.{name}" if part in SIDES else name
