"""A step of torque on a pair at rest: what CalculiX found (`validation/calculix/torque_step.py`), and what we find."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig, elastic_rig, machine_for
from gearbench.bench.full.run import full_gears, full_machine
from gearbench.fem.full import record
from gearbench.fem.full import start as full_start
from gearbench.fem.full.transient import make_integrator
from gearbench.fem.motion import start, transient
from gearbench.fem.motion.machine import angles, mass_matrix
from gearbench.fem.motion.scheme import Scheme, make_scheme
from gearbench.rig import read_case

Array = NDArray[np.float64]

FOLDER = Path(__file__).parents[1] / "validation" / "calculix"
RUNS: list[dict[str, Any]] = json.loads((FOLDER / "torque_step.json").read_text(encoding="utf-8"))["runs"]
TORQUE = 30.0  # [N m]
DURATION = 0.72e-3  # [s]
REFERENCE = {"across": 3.0, "size": 1.0, "penalty": 1.0, "steps": 36}
STEP = 2e-6  # of our models [s]
REST = 1e-3  # driver torque under which the flanks just touch [N m]
class Course(NamedTuple):
    """Times (n,) [s] after the step of torque, and transmission errors (n,) [m]."""

    time: Array
    dte: Array

    @property
    def period(self) -> float:
        """Time [s] at which the driver is back for the first time: the vertex of a parabola through three samples."""
        top = int(self.dte.argmax())
        k = top + int(self.dte[top:].argmin())
        near = slice(k - 1, k + 2)
        two, one, _ = np.polyfit(self.time[near] - self.time[k], self.dte[near], 2)
        return float(self.time[k] - one / (2 * two))


def chosen(**settings: float) -> list[dict[str, Any]]:
    """The runs of CalculiX with these settings."""
    return [run for run in RUNS if all(run[name] == value for name, value in settings.items())]


def stored(**settings: float) -> Course:
    """What the one run of CalculiX with these settings found."""
    (run,) = chosen(**settings)
    return Course(np.array(run["time"]), 1e-6 * np.array(run["dte_um"]))


@cache
def elastic() -> ElasticRig:
    """The pair."""
    case = read_case(FOLDER / "torque_step.toml")
    return elastic_rig(case.rig, case.simulation)


def reduced_course(scheme: Scheme, count: int) -> Course:
    """The reduced model's, its torque and the acceleration by it acting from the first instant on, as CalculiX's."""
    machine = machine_for(elastic(), 0.0)
    rest = start.initial_state(machine, REST)
    push = np.zeros(len(rest.d))
    push[machine.driven_at] = TORQUE - REST
    mass = mass_matrix(machine, *angles(machine, rest.d, 0.0))
    rest = rest._replace(load=rest.load + push, a=np.linalg.solve(mass, push), torque=TORQUE)
    _, samples, _ = transient.advance(machine, scheme, rest, np.full(count, TORQUE), 1)
    time = scheme.step * np.arange(1, count + 1)
    return Course(time, elastic().pair.driver.base_radius * transient.columns(samples).angle_driver)


@cache
def by_the_same_scheme(**settings: float) -> Course:
    """The reduced model's course in the steps of a run of CalculiX and by its scheme (Hilber, Hughes and Taylor's alpha
    method is generalised-alpha without weights on the inertia), so that both make the same error of the step."""
    truth, (run,) = stored(**settings), chosen(**settings)
    alpha, count = -float(run["alpha"]), len(truth.time)
    step = float(truth.time[-1]) / count
    return reduced_course(Scheme(step, 0.0, alpha, 0.5 + alpha, 0.25 * (1.0 + alpha) ** 2), count)


@cache
def in_short_steps(model: str) -> Course:
    """The course of the reduced or the full model, its own error of the step being negligible."""
    scheme, count = make_scheme(STEP, 1.0), round(DURATION / STEP)
    if model == "reduced":
        return reduced_course(scheme, count)
    case = read_case(FOLDER / "torque_step.toml")
    machine = full_machine(elastic(), full_gears(case.rig, case.simulation, lambda note: None), 0.0)
    rest = full_start.initial_state(machine, REST)
    run = record.advance(make_integrator(machine, scheme), rest, np.full(count, TORQUE))
    angle = record.columns(run.samples).angle_driver
    # The torque rises within the first step: as if it acted half a step later.
    time = STEP * (np.arange(1, count + 1) - 0.5)
    return Course(time, elastic().pair.driver.base_radius * angle)


class Apart(NamedTuple):
    """Relative differences: of the period, and of the transmission error, rms over rms."""

    period: float
    dte: float


def apart(model: str, **settings: float) -> Apart:
    """How far a model is from a run of CalculiX; that run's error of the step, taken to be that of the reduced model by
    the same scheme, counts for neither."""
    truth, alike, exact = stored(**settings), by_the_same_scheme(**settings), in_short_steps("reduced")
    found = in_short_steps(model)
    course = alike.dte + np.interp(truth.time, found.time, found.dte) - np.interp(truth.time, exact.time, exact.dte)
    period = alike.period * found.period / exact.period
    dte = float(np.sqrt(np.mean((course - truth.dte) ** 2) / np.mean(truth.dte**2)))
    return Apart(period / truth.period - 1.0, dte)
