"""Which records a fit can follow downhill: those whose flanks stay together, or where they do in none, all of them with
the driver nudged along the measured motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np

from gearbench.diagnosis.evidence.problem import Problem
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.replay.replays import Replay
from gearbench.rig import Case

# Part of the time without contact from which a record is too rough to follow downhill: small changes make jumps.
LOSING = 0.01
# The same where no record is smoother: impacts that are few and repeat bend a fit without breaking it.
LOSING_MORE = 0.1


def followable(
    rigs: Sequence[Case], measurements: Sequence[Measurement], problem: Problem, simulate: Replay
) -> tuple[list[int], Mapping[str, float], frozenset[str]]:
    """Numbers of the records that a fit can follow, what nudges the driver in each that parts its flanks, by its name
    [N s/m], and the names of those that part for long: those whose flanks stay together on the first rig that has any
    (the nominal one may resonate where the records' does not), else all, nudged."""
    lost = lost_contact(rigs[0], measurements, simulate)
    others = (lost_contact(rig, measurements, simulate) for rig in rigs[1:])
    for one in chain([lost], others):
        smooth = _below(one, LOSING)
        if smooth:
            return smooth, {}, frozenset()
    nudges = nudges_of(problem.model, problem.conditions)
    if not lost or len(nudges) < len(measurements):
        return smooth_records(rigs, measurements, simulate), {}, frozenset()
    restless = {one.name for one, part in zip(measurements, lost, strict=True) if part >= LOSING_MORE}
    return list(range(len(measurements))), nudges, frozenset(restless)


def nudges_of(model: NominalModel, conditions: Sequence[Condition]) -> dict[str, float]:
    """Damper [N s/m] between the driver and its motion as each condition's record has it, by its name: as stiff as the
    mesh where the driver vibrates on it."""
    mass = (model.inertia[0] + model.rotor) / model.base_radius[0] ** 2
    known = [one for one in conditions if "angle_driver" in one.spectra]
    return {one.name: float(np.sqrt(one.stiffness_level * mass)) for one in known}


def smooth_records(rigs: Sequence[Case], measurements: Sequence[Measurement], simulate: Replay) -> list[int]:
    """Numbers of the records whose flanks stay together on the first of the rigs, and where there is none, of those
    that part for little of their time: elsewhere small changes make jumps, so that no fit can follow them. Where there
    is none of these either the next rig is asked: a resonance of the first need not be the records'."""
    for rig in rigs:
        lost = lost_contact(rig, measurements, simulate)
        for limit in (LOSING, LOSING_MORE):
            smooth = _below(lost, limit)
            if smooth:
                return smooth
    return []


def _below(lost: Sequence[float], limit: float) -> list[int]:
    """Numbers of the records that are without contact for a smaller part of their time."""
    return [number for number, part in enumerate(lost) if part < limit]


def parts(rig: Case, measured: Measurement, simulate: Replay) -> bool:
    """Whether the flanks of a rig part in a record so long that no fit can follow it; not where it cannot be told."""
    lost = lost_contact(rig, [measured], simulate)
    return bool(lost and lost[0] >= LOSING)


def lost_contact(rig: Case, measurements: Sequence[Measurement], simulate: Replay) -> list[float]:
    """Part of the time that the working flanks of a rig are apart in each record, whether the back flanks touch (as
    they do at once without backlash) or not; empty where it cannot be simulated in one of them, or one does not tell
    the mesh phase."""
    if not all(one.phase_known for one in measurements):
        return []
    lost = []
    for one in measurements:
        try:
            steady = simulate(rig, one.record)
        except ValueError:
            return []
        samples = max(int(np.prod(steady["time"].shape)), 1)
        unloaded = steady.attrs.get("unloaded_samples", steady.attrs.get("contact_lost_samples", 0))
        lost.append(float(unloaded) / samples)
    return lost
