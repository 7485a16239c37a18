"""Does a record belong to the nominal rig? Refusals name file, field, value, limit.

What a record says about itself is checked for every command alike (records/checks); here it is held against the case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, degrees, log, pi

import numpy as np
import xarray as xr

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.geometry import pair
from gearbench.records.checks import ANGLE_UNITS, TORQUE_UNITS, mean_speed, unit_hint
from gearbench.rig import Case, Experiment

GEARS = ("driver", "driven")

# Relative tolerances of what a record says about its rig against the nominal one.
BASE_RADIUS = 1e-3
WORKING_ANGLE_DEG = 0.5
# A record that bears the name of one of the case's conditions must be of that condition.
NAMED_SPEED, NAMED_TORQUE = 0.05, 0.3
# Up to which a record that names none is of the nearest one; else that is said.
LIKE = 0.05
# Beyond these factors of every condition the nominal rig is another rig, or the unit another unit.
FAR = 3.0
# Displacements against the static deflection under the largest torque.
DISPLACEMENT = 100.0
# A reversed displacement of at least this part of the static deflection is a sensor the wrong way round.
REVERSED = 0.3
# Largest distance of the angles' zero from unloaded contact [in mean static deflections] to be taken as such.
ZERO = 50.0


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
    stiffness = (rig.support.driver.holding(1.0).stiffness, rig.support.driven.holding(1.0).stiffness)
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


def told_by_case(record: xr.Dataset, source: str, facts: Facts) -> tuple[xr.Dataset, list[str]]:
    """The record with what it does not say about its rig taken from the case, and what must be said about that.

    Raises DiagnosisError where the record lacks a channel, or is of another rig.
    """
    notes: list[str] = []
    _check_channels(record, source)
    _check_attributes(record, source, facts, notes)
    known = {
        "teeth_driver": facts.teeth[0],
        "teeth_driven": facts.teeth[1],
        "base_radius_driver": facts.base_radii[0],
        "base_radius_driven": facts.base_radii[1],
        "working_pressure_angle": facts.working_angle,
        "support_direction": facts.direction,
        "driven_boundary": facts.boundary,
    }
    return record.assign_attrs({key: value for key, value in known.items() if key not in record.attrs}), notes


def check_against_nominal(record: xr.Dataset, name: str, source: str, facts: Facts) -> tuple[str, list[str]]:
    """The name of the case's condition that a sound record belongs to, and what must be said about it.

    Raises DiagnosisError where speed, torque or displacements are those of another rig or of other units.
    """
    notes: list[str] = []
    torque = float(record["torque_driver"].values[0].mean())
    if not torque > 0.0:
        raise DiagnosisError(
            f"{source}: the mean of torque_driver is {torque:.4g} N m and must be positive: it closes the working"
            " flanks"
        )
    frequency = angle_frequency(record, facts)
    condition, named = _condition(record, name, frequency, torque, facts)
    _check_condition(source, condition, named, (frequency, torque), facts, notes)
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


def angle_frequency(record: xr.Dataset, facts: Facts) -> float:
    """Mesh frequency [Hz] at which the driver's angle turns: slope of its linear fit times teeth / 2 pi."""
    return mean_speed(record, "driver") * facts.teeth[0] / (2 * pi)


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
        (measured[0], _frequency(wanted, facts), NAMED_SPEED, "mesh frequency", "Hz", ANGLE_UNITS, "the angles"),
        (measured[1], wanted.torque_mean, NAMED_TORQUE, "mean torque", "N m", TORQUE_UNITS, "torque_driver"),
    ):
        off = got / nominal
        if abs(off - 1) <= (tolerance if named else min(tolerance, LIKE)):
            continue
        said = f"{words} {got:.4g} {unit}, where the case's {where} has {nominal:.4g} {unit}"
        if named or not 1 / FAR < off < FAR:
            limit = f"{tolerance:.0%}" if named else f"a factor {FAR:g}"
            raise DiagnosisError(f"{source}: {said} (limit {limit}){unit_hint(off, hints, channel)}")
        notes.append(f"{said}: no condition of the case is like this one, so it is judged at its own speed and torque")


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
