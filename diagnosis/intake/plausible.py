"""Does a record belong to the nominal rig, and is it in the right units? Refusals name file, field, value, limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, degrees, log, pi

import numpy as np
import xarray as xr

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.geometry import pair
from gearbench.rig import Case, Experiment

GEARS = ("driver", "driven")

# Relative tolerances of what a record says about its rig against the nominal one.
BASE_RADIUS = 1e-3
WORKING_ANGLE_DEG = 0.5
RATIO = 1e-3  # of the two speeds against the teeth
# What a record says about itself: declared speed against the angles, declared mean torque against the channel.
OWN_SPEED, OWN_TORQUE = 0.01, 0.02
# A record that bears the name of one of the case's conditions must be of that condition.
NAMED_SPEED, NAMED_TORQUE = 0.05, 0.3
# Beyond these factors of every condition the nominal rig is another rig, or the unit another unit.
FAR = 3.0
# Mean load torque against the mean torque times z2/z1.
LOAD_TORQUE = 0.3
# Displacements against the static deflection under the largest torque.
DISPLACEMENT = 100.0
# A reversed displacement of at least this part of the static deflection is a sensor the wrong way round.
REVERSED = 0.3
# Largest distance of the angles' zero from unloaded contact [in mean static deflections] to be taken as such.
ZERO = 50.0

_ANGLE_HINTS = {180 / pi: "degrees", 1 / (2 * pi): "turns", 1000.0: "mrad"}
_TORQUE_HINTS = {1e3: "N mm", 1e-3: "kN m", 0.737562: "lbf ft", 8.850746: "lbf in"}


@dataclass(frozen=True)
class Facts:
    """What the nominal case lets one expect: teeth, base radii [m], working pressure angle [rad], support
    stiffnesses [N/m], cosine by which the mesh force acts on y, `slack` [m] (a distance of the angles' zero
    from contact that is still a deflection), conditions by name (one named "" if the case has none)."""

    teeth: tuple[int, int]
    base_radii: tuple[float, float]
    working_angle: float
    stiffness: tuple[float, float]
    factor: float
    direction: str
    boundary: str
    slack: float
    conditions: dict[str, Experiment]


def facts_of(nominal: Case) -> Facts:
    """The expectations that a nominal case sets. Raises GeometryError for gears that do not mesh."""
    rig, meshing = nominal.rig, pair(nominal.rig)
    conditions = {one.name: one.experiment for one in nominal.conditions} or {"": nominal.experiment}
    stiffness = (rig.support.driver.stiffness, rig.support.driven.stiffness)
    factor = cos(meshing.working_pressure_angle) if rig.support.direction == "tangential" else 1.0
    base = (meshing.driver.base_radius, meshing.driven.base_radius)
    load = max(one.torque_mean for one in conditions.values()) / base[0]
    return Facts(
        (rig.driver.teeth, rig.driven.teeth),
        base,
        meshing.working_pressure_angle,
        stiffness,
        factor,
        rig.support.direction,
        rig.load.boundary,
        # The mesh itself gives way by some 1e8 N/m, a little more or less than the supports.
        ZERO * load * (1 / stiffness[0] + 1 / stiffness[1] + 1e-8) + 10 * meshing.backlash_normal,
        conditions,
    )


def check_against_nominal(record: xr.Dataset, name: str, source: str, facts: Facts) -> tuple[str, list[str]]:
    """The name of the case's condition that the record belongs to, and what must be said about it.

    Raises DiagnosisError where the record is of another rig, of other units, or contradicts itself.
    """
    notes: list[str] = []
    _check_channels(record, source)
    _check_attributes(record, source, facts, notes)
    _check_angles(record, source, facts)
    torque = _mean_torque(record, source)
    frequency = angle_frequency(record, source, facts)
    condition, named = _condition(record, name, frequency, torque, facts)
    _check_condition(source, condition, named, (frequency, torque), facts, notes)
    _check_declared_speed(record, source, frequency)
    _check_load_torque(record, source, torque, facts, notes)
    _check_displacements(record, source, facts, notes)
    return condition, notes


def check_same_rig(records: Sequence[xr.Dataset], sources: Sequence[str]) -> None:
    """Raise DiagnosisError unless all records say the same about the rig."""
    for key, unit, tolerance in (
        ("inertia_driver", "kg m^2", 1e-6),
        ("inertia_driven", "kg m^2", 1e-6),
        ("base_radius_driver", "m", 1e-6),
        ("base_radius_driven", "m", 1e-6),
        ("working_pressure_angle", "rad", 1e-6),
    ):
        known = [(float(r.attrs[key]), s) for r, s in zip(records, sources, strict=True) if key in r.attrs]
        for value, source in known[1:]:
            if abs(value - known[0][0]) > tolerance * abs(known[0][0]):
                raise DiagnosisError(
                    f"{known[0][1]} and {source} are of different rigs: {key} = {known[0][0]:g} and {value:g} {unit}"
                    f" (limit {tolerance:g} of it)"
                )


def angle_frequency(record: xr.Dataset, source: str, facts: Facts) -> float:
    """Mesh frequency [Hz] at which the driver's angle turns: slope of its linear fit times teeth / 2 pi."""
    return _slope(record, "driver") * facts.teeth[0] / (2 * pi)


def _check_channels(record: xr.Dataset, source: str) -> None:
    for name in ("angle_driver", "angle_driven", "torque_driver"):
        if name not in record:
            raise DiagnosisError(
                f"{source} has no channel {name}: diagnosis needs angle_driver, angle_driven and torque_driver"
                " (dte and force alone do not tell where the gap is)"
            )


def _check_attributes(record: xr.Dataset, source: str, facts: Facts, notes: list[str]) -> None:
    for number, gear in enumerate(GEARS):
        key, wanted = f"teeth_{gear}", facts.teeth[number]
        if key not in record.attrs:
            notes.append(f"the record does not say {key}: taken from the case, {wanted}")
        elif int(record.attrs[key]) != wanted:
            raise DiagnosisError(
                f"{source}: {key} = {int(record.attrs[key])}, but the case has rig.{gear}.teeth = {wanted}: the record"
                " is of another rig"
            )
        key, radius = f"base_radius_{gear}", facts.base_radii[number]
        if key in record.attrs and abs(float(record.attrs[key]) - radius) > BASE_RADIUS * radius:
            raise DiagnosisError(
                f"{source}: {key} = {1e3 * float(record.attrs[key]):.6g} mm, but the case's gear has"
                f" {1e3 * radius:.6g} mm (limit {BASE_RADIUS:.1%}): the record is of another rig"
            )
    angle = record.attrs.get("working_pressure_angle")
    if angle is not None and abs(degrees(float(angle) - facts.working_angle)) > WORKING_ANGLE_DEG:
        raise DiagnosisError(
            f"{source}: working_pressure_angle = {degrees(float(angle)):.4g} deg, but the case's gears work at"
            f" {degrees(facts.working_angle):.4g} deg (limit {WORKING_ANGLE_DEG:g} deg): the record is of another rig"
        )
    for key, expected, where in (
        ("support_direction", facts.direction, "rig.support.direction"),
        ("driven_boundary", facts.boundary, "rig.load.boundary"),
    ):
        if str(record.attrs.get(key, expected)) != expected:
            raise DiagnosisError(f'{source}: {key} = "{record.attrs[key]}", but the case has {where} = "{expected}"')


def _check_angles(record: xr.Dataset, source: str, facts: Facts) -> None:
    for gear in GEARS:
        values = record[f"angle_{gear}"].values[0]
        steps = np.diff(values)
        jump = float(np.abs(steps - np.median(steps)).max())
        if jump > pi:
            raise DiagnosisError(
                f"{source}: angle_{gear} jumps by {jump:.4g} rad between two samples (limit pi): a record holds"
                " absolute, unwrapped angles in rad"
            )
        if not _slope(record, gear) > 0.0:
            raise DiagnosisError(
                f"{source}: angle_{gear} does not rise (mean speed {_slope(record, gear):.4g} rad/s, must be positive):"
                " each angle is positive in its gear's own direction of rotation"
            )
    got, wanted = _slope(record, "driver") / _slope(record, "driven"), facts.teeth[1] / facts.teeth[0]
    if abs(got / wanted - 1) > RATIO:
        raise DiagnosisError(
            f"{source}: the speeds of angle_driver and angle_driven have the ratio {got:.6g}, but the case's teeth"
            f" {facts.teeth[0]}/{facts.teeth[1]} want {wanted:.6g} (limit {RATIO:.1%})"
            + _hint(got / wanted, _ANGLE_HINTS, "angle_driver")
            + _hint(wanted / got, _ANGLE_HINTS, "angle_driven")
        )


def _mean_torque(record: xr.Dataset, source: str) -> float:
    torque = float(record["torque_driver"].values[0].mean())
    declared = float(record.attrs.get("torque_mean", torque))
    if abs(torque - declared) > OWN_TORQUE * abs(declared):
        raise DiagnosisError(
            f"{source}: the mean of torque_driver is {torque:.4g} N m, but attribute torque_mean = {declared:.4g} N m"
            f" (limit {OWN_TORQUE:.0%})" + _hint(torque / declared if declared else 0.0, _TORQUE_HINTS, "torque_driver")
        )
    if not torque > 0.0:
        raise DiagnosisError(
            f"{source}: the mean of torque_driver is {torque:.4g} N m and must be positive: it closes the working"
            " flanks"
        )
    return torque


def _condition(
    record: xr.Dataset, name: str, frequency: float, torque: float, facts: Facts
) -> tuple[str, bool]:
    """The condition of the case that the record names (True), or else the nearest one (False)."""
    own = str(record.attrs.get("condition", ""))
    if own and own in facts.conditions:
        return own, True
    matches = [one for one in facts.conditions if one and (name == one or name.endswith(f"-{one}"))]
    if matches:
        return max(matches, key=len), True

    def distance(one: str) -> float:
        wanted = facts.conditions[one]
        return abs(log(frequency / _frequency(wanted, facts))) + abs(log(torque / wanted.torque_mean))

    return min(facts.conditions, key=distance), False


def _check_condition(
    source: str, name: str, named: bool, measured: tuple[float, float], facts: Facts, notes: list[str]
) -> None:
    """Speed and mean torque against the condition's: refused far off, or off by name; else said."""
    wanted = facts.conditions[name]
    where = f'condition "{name}"' if name else "experiment"
    for got, nominal, tolerance, words, unit, hints, channel in (
        (measured[0], _frequency(wanted, facts), NAMED_SPEED, "mesh frequency", "Hz", _ANGLE_HINTS, "the angles"),
        (measured[1], wanted.torque_mean, NAMED_TORQUE, "mean torque", "N m", _TORQUE_HINTS, "torque_driver"),
    ):
        off = got / nominal
        if abs(off - 1) <= tolerance:
            continue
        said = f"{words} {got:.4g} {unit}, where the case's {where} has {nominal:.4g} {unit}"
        if named or not 1 / FAR < off < FAR:
            limit = f"{tolerance:.0%}" if named else f"a factor {FAR:g}"
            raise DiagnosisError(f"{source}: {said} (limit {limit}){_hint(off, hints, channel)}")
        notes.append(f"{said}: no condition of the case is like this one, so it is judged at its own speed and torque")


def _check_declared_speed(record: xr.Dataset, source: str, frequency: float) -> None:
    if "mesh_period" not in record.attrs:
        return
    declared = 1.0 / float(record.attrs["mesh_period"])
    if abs(frequency / declared - 1) > OWN_SPEED:
        raise DiagnosisError(
            f"{source}: angle_driver turns at a mesh frequency of {frequency:.5g} Hz, but attribute mesh_period says"
            f" {declared:.5g} Hz (limit {OWN_SPEED:.0%})" + _hint(frequency / declared, _ANGLE_HINTS, "the angles")
        )


def _check_load_torque(record: xr.Dataset, source: str, torque: float, facts: Facts, notes: list[str]) -> None:
    if "torque_driven" not in record:
        return
    wanted = torque * facts.teeth[1] / facts.teeth[0]
    off = float(record["torque_driven"].values[0].mean()) / wanted
    if abs(off - 1) > LOAD_TORQUE:
        raise DiagnosisError(
            f"{source}: the mean of torque_driven is {off * wanted:.4g} N m, where the mean of torque_driver and the"
            f" teeth want {wanted:.4g} N m (limit {LOAD_TORQUE:.0%}); it is positive against the driven rotation"
            + _hint(off, _TORQUE_HINTS, "torque_driven")
        )


def _check_displacements(record: xr.Dataset, source: str, facts: Facts, notes: list[str]) -> None:
    """Magnitude and sign of y against the static deflection of the supports."""
    force = record["torque_driver"].values[0] / facts.base_radii[0] * facts.factor
    for gear, stiffness, sign in zip(GEARS, facts.stiffness, (-1.0, 1.0), strict=True):
        name = f"y_{gear}"
        if name not in record:
            continue
        values = record[name].values[0]
        expected = float(np.abs(force).max()) / stiffness
        largest = float(np.abs(values).max())
        if largest > DISPLACEMENT * expected:
            raise DiagnosisError(
                f"{source}: {name} reaches {largest:.3g}, where the support of the case gives way by {expected:.3g} m"
                f" (limit {DISPLACEMENT:g} times that): is it in mm or um, or off its zero? A record holds m from the"
                " unloaded position"
            )
        static = sign * float(force.mean()) / stiffness
        if float(values.mean()) / static < -REVERSED:
            raise DiagnosisError(
                f"{source}: the mean of {name} is {1e6 * values.mean():.3g} um, where the load pushes the gear by"
                f" {1e6 * static:.3g} um: is the sensor the wrong way round? y is positive along the pitch-point"
                " velocity"
            )
        if largest < expected / DISPLACEMENT:
            notes.append(
                f"{name} stays within {1e6 * largest:.2g} um, where the support should give way by"
                f" {1e6 * expected:.2g} um: sensor, unit or support are not what the case says"
            )


def _frequency(wanted: Experiment, facts: Facts) -> float:
    return wanted.mesh_frequency_for(facts.teeth[0])


def _slope(record: xr.Dataset, gear: str) -> float:
    """Mean speed [rad/s] of a gear by a linear fit."""
    values = record[f"angle_{gear}"].values[0]
    steps = np.arange(values.size) - 0.5 * (values.size - 1)
    return float(steps @ (values - values.mean()) / (steps @ steps)) * float(record.attrs["sampling_rate"])


def _hint(off: float, known: dict[float, str], channel: str) -> str:
    """A guess at the unit from the factor by which something is off."""
    units = [unit for factor, unit in known.items() if off > 0 and abs(off / factor - 1) < 0.1]
    return f"; is {channel} in {units[0]}?" if units else ""
