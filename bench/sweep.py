"""Speed up and down at constant torque: what the mesh answers at every speed, each begun from the one before, the first
of either direction at rest.

Whatever the model: it needs to hand a state on to another speed and to tell the force of its mesh (`Sweepable`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import ceil, log, pi
from pathlib import Path
from threading import Event, Lock
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.models import model_for
from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import ProgressReport, schedule
from gearbench.bench.plan.settling import change
from gearbench.bench.plan.workers import READY, processors, realisations
from gearbench.bench.protocol import Model, Prepared
from gearbench.bench.record.attributes import turning_inertias
from gearbench.bench.refusals.gears import check_gears
from gearbench.bench.tape import Shelf, Tape
from gearbench.files import fingerprint
from gearbench.geometry import pair
from gearbench.geometry.tooth.iso1328 import drawn_gear
from gearbench.lumped.stiffness.dynamic_factor import deviations, dynamic_factor, resonance_speed
from gearbench.lumped.stiffness.iso6336 import iso_stiffness
from gearbench.records.provenance import source_digest
from gearbench.rig import Case, Rig, dump_case

Array = NDArray[np.float64]

SAMPLES = 128  # of a mesh period
CYCLES = 16  # mesh periods of a look: subharmonics down to a sixteenth show as lines of their own
TRANSIENT = 1e-3  # of its size, that free vibrations keep before the first look
TOLERANCE = 1e-3  # change of the DTE from look to look, over its standard deviation
WAIT = 128  # looks that pass at most before the first one: 2048 mesh periods
LOOKS = 12  # after which a motion counts as one that does not settle
DIRECTIONS = ("up", "down")


@runtime_checkable
class Sweepable(Protocol):
    """What a `Prepared` offers beside, for a sweep."""

    @property
    def settling(self) -> float:
        """Slowest rate [1/s] at which free vibrations die out."""

    def resume(self, state: Any) -> Any:
        """A state that another speed ended with, after whole mesh periods, as the start of this one."""

    def mesh_force(self, outputs: Array) -> Array:
        """Force of the mesh (samples,) [N] along the line of action."""


class Look(NamedTuple):
    """What is kept of a speed: rms of the DTE about its mean [m], its mean [m], largest mesh force over the static one,
    part of the time without contact and beyond what is modelled, change from look to look, whether free vibrations had
    to be left to die out for longer than `WAIT`, amplitudes (orders,) [m]."""

    dte_rms: float
    dte_mean: float
    dynamic_factor: float
    contact_loss: float
    beyond_model: float
    residual: float
    hurried: bool
    spectrum: Array


def sweep(
    case: Case,
    speeds: Sequence[float],
    model: str | None = None,
    progress: ProgressReport | None = None,
    *,
    checkpoints: str | Path | None = None,
    workers: int | None = None,
) -> xr.Dataset:
    """Steady answer to the mean torque at driver speeds [rad/s], upwards and downwards.

    Variables over (direction, speed): dte_rms, dte_mean [m], dynamic_factor, contact_loss, beyond_model, residual,
    settled; and dte_amplitude (direction, speed, order) [m], order in mesh orders. iso_dynamic_factor (speed): K_v by
    ISO 6336-1 Method B. Both directions run side by side unless `workers` (absent: as many as there are processors) is
    1; the result is the same to the last bit. `progress` is called from any of their threads. `checkpoints`: a folder
    for the speeds that are done, from which the same sweep goes on, as in `simulate`. Raises BenchError for a model
    that cannot be swept, FileError for a folder of another origin.
    """
    report = progress or (lambda fraction, note: None)
    case, solver = model_for(_still(case), model)
    check_gears(case.rig)
    solver.refuse(case)
    rising = sorted(speeds)
    if not rising or not rising[0] > 0:
        raise BenchError("a sweep needs at least one speed above 0")
    if workers is not None and workers < 1:
        raise BenchError(f"workers = {workers} must be at least 1")
    shelf = None if checkpoints is None else Shelf(Path(checkpoints), _identity(case, rising))
    ways = _both_ways(case, solver, rising, report, processors() if workers is None else workers, shelf)
    return _dataset(case, solver, np.array(rising), dict(zip(DIRECTIONS, ways, strict=True)))


def _both_ways(
    case: Case, solver: Model, rising: Sequence[float], report: ProgressReport, workers: int, shelf: Shelf | None
) -> list[list[Look]]:
    """Looks at rising speeds, upwards and downwards, each direction begun at rest, or where the shelf has it ended."""
    done = np.zeros(len(DIRECTIONS))
    lock, stop = Lock(), Event()

    def run(number: int) -> list[Look]:
        direction = DIRECTIONS[number]
        order = rising if direction == "up" else rising[::-1]
        tape = None if shelf is None else shelf.tape(direction, _prepared(_at(case, order[0]), solver).start(0))
        found = [] if tape is None else _kept(tape)
        last = tape.state if tape is not None and found else None

        def tell(share: float, at: int, speed: float) -> None:
            if stop.is_set():
                raise InterruptedError("the other direction has failed, or the sweep was interrupted")
            with lock:
                done[number] = (at + share) / len(order)
                report(float(done.mean()), f"{direction}, {speed * 30 / pi:.0f} rpm")

        try:
            for at in range(len(found), len(order)):
                look, last = _look(case, solver, order[at], last, partial(tell, at=at, speed=order[at]))
                found.append(look)
                if tape is not None:
                    tape.put(last, _row(look))
        finally:
            if tape is not None:
                tape.flush()
        return found if direction == "up" else found[::-1]

    if len(rising) == 1:
        return [run(0)] * 2
    if workers == 1:
        return [run(number) for number in range(2)]  # here, where an interruption arrives at once
    return realisations(run, 2, stop, workers)


def _identity(case: Case, speeds: Sequence[float]) -> str:
    return fingerprint(dump_case(case), source_digest(), *(speed.hex() for speed in speeds))


def _row(look: Look) -> Array:
    """A look as one row (1, n) of numbers."""
    return np.concatenate([look[:-1], look.spectrum])[None]


def _kept(tape: Tape) -> list[Look]:
    """The looks that a tape holds, its state being that at the end of the last one."""
    found: list[Look] = []
    while (rows := tape.take(1)) is not None:
        names = Look._fields[:-1]
        values: dict[str, Any] = dict(zip(names, rows[0, : len(names)].tolist(), strict=True))
        values["hurried"] = bool(values["hurried"])
        found.append(Look(**values, spectrum=rows[0, len(names) :]))
    return found


def _still(case: Case) -> Case:
    experiment = case.experiment.model_copy(update={"multisine": None})
    return case.model_copy(update={"experiment": experiment, "conditions": ()})


def _at(case: Case, speed: float) -> Case:
    """The case at a driver speed [rad/s], sampled in step with the mesh."""
    frequency = speed * case.rig.driver.teeth / (2 * pi)
    values = {"sampling_rate": SAMPLES * frequency, "samples_per_period": SAMPLES * CYCLES, "periods": 1}
    return case.model_copy(update={"experiment": case.experiment.at_speed(speed).model_copy(update=values)})


def _prepared(there: Case, solver: Model) -> Prepared[Any]:
    with READY:
        return solver.prepare(there, schedule(there.experiment, there.rig), lambda note: None)


def _look(
    case: Case, solver: Model, speed: float, before: Any, tell: Callable[[float], None]
) -> tuple[Look, Any]:
    """One speed, from the state `before` that another one ended with (None: from rest), and the state at its end;
    `tell` hears of the fraction done that is certain."""
    there = _at(case, speed)
    prepared = _prepared(there, solver)
    if not isinstance(prepared, Sweepable):
        raise BenchError(
            f"the {solver.title} of this case cannot be swept over speed: set simulation.model = \"reduced\", or"
            ' "lumped" and simulation.mesh_stiffness = "finite-element"'
        )
    drive = prepared.drive(Torque(there.experiment.torque_mean))
    state = prepared.start(0) if before is None else prepared.resume(before)
    rate = there.experiment.sampling_rate
    wanted = waiting(prepared.settling, rate)
    wait = min(wanted, WAIT)
    block = SAMPLES * CYCLES
    outputs: Array | None = None
    residual = np.inf
    for _ in range(LOOKS):
        for ahead in range(wait if outputs is None else max(wait // 4, 1)):
            tell(ahead / (wait + 1) if outputs is None else wait / (wait + 1))
            state, earlier = prepared.advance(drive, state, block)
        state, outputs = prepared.advance(drive, state, block)
        residual = change(prepared.dte(earlier), prepared.dte(outputs))
        if residual <= TOLERANCE:
            break
    assert outputs is not None
    return _measured(prepared, prepared, outputs, residual, there)._replace(hurried=wanted > WAIT), state


def waiting(settling: float, rate: float) -> int:
    """Looks, of that sampling rate [Hz], in which vibrations that die out at the rate `settling` [1/s] keep the part
    TRANSIENT; those that die out more slowly than at 1/s count as if at that."""
    return max(ceil(log(1 / TRANSIENT) / max(settling, 1.0) * rate / (SAMPLES * CYCLES)), 1)


def _measured(prepared: Prepared[Any], mesh: Sweepable, outputs: Array, residual: float, case: Case) -> Look:
    dte, apart, beyond = prepared.dte(outputs), prepared.apart(outputs), prepared.strayed(outputs)
    static = case.experiment.torque_mean / pair(case.rig).driver.base_radius
    return Look(
        dte_rms=float(dte.std()),
        dte_mean=float(dte.mean()),
        dynamic_factor=float(mesh.mesh_force(outputs).max()) / static,
        contact_loss=0.0 if apart is None else float(apart.mean()),
        beyond_model=0.0 if beyond is None else float(beyond.mean()),
        residual=residual,
        hurried=False,
        spectrum=2 * np.abs(np.fft.rfft(dte - dte.mean()))[: SAMPLES * CYCLES // 4] / dte.size,
    )


def iso_factors(case: Case, speeds: Array) -> tuple[Array, float]:
    """K_v by ISO 6336-1 Method B at driver speeds (n,) [rad/s], and the resonance speed of the driver [rad/s]. Errors
    that a grade draws count as those that are given."""
    drawn = {side: drawn_gear(getattr(case.rig, side), f"rig.{side}") for side in ("driver", "driven")}
    rig, meshing = case.rig.model_copy(update=drawn), pair(case.rig)
    width = 1e3 * meshing.face_width
    force = case.experiment.torque_mean / meshing.driver.base_radius
    found = iso_stiffness(rig, meshing, force)
    radii = meshing.driver.base_radius, meshing.driven.base_radius
    one, two = (j / r**2 / width for j, r in zip(turning_inertias(rig, meshing), radii, strict=True))
    resonance = resonance_speed(rig.driver.teeth, found.mesh, (one, two)) * pi / 30
    tangential = 2 * case.experiment.torque_mean / (rig.driver.module * rig.driver.teeth)  # at the reference circle
    load = tangential / width
    b = deviations(load, found.single, **_errors(rig))
    return np.array([dynamic_factor(speed / resonance, load, meshing.contact_ratio, b) for speed in speeds]), resonance


def _errors(rig: Rig) -> dict[str, float]:
    """Deviations that ISO asks for [um]: of the gear that has more, and the tip relief of the one that has less."""
    gears = (rig.driver, rig.driven)
    pitch = [np.abs(np.diff([*gear.pitch_error, *gear.pitch_error[:1]])).max(initial=0.0) for gear in gears]
    form = [float(np.ptp(gear.profile_form)) if gear.profile_form else abs(gear.profile_slope) for gear in gears]
    relief = min(gear.tip_relief for gear in gears)
    return {"base_pitch": 1e6 * max(pitch), "profile": 1e6 * max(form), "tip_relief": 1e6 * relief}


def _dataset(case: Case, solver: Model, speeds: Array, looks: dict[str, list[Look]]) -> xr.Dataset:
    iso, resonance = iso_factors(case, speeds)
    units = dict.fromkeys(Look._fields[:6], "1") | {"dte_rms": "m", "dte_mean": "m"}
    both = {
        name: (
            ("direction", "speed"),
            np.array([[getattr(one, name) for one in looks[d]] for d in DIRECTIONS]),
            {"units": unit},
        )
        for name, unit in units.items()
    }
    spectra = np.array([[one.spectrum for one in looks[d]] for d in DIRECTIONS])
    order = np.arange(spectra.shape[-1]) / CYCLES
    return xr.Dataset(
        {
            **both,
            "settled": (("direction", "speed"), (both["residual"][1] <= TOLERANCE).astype(float), {"units": "1"}),
            "dte_amplitude": (("direction", "speed", "order"), spectra, {"units": "m"}),
            "iso_dynamic_factor": (("speed",), iso, {"units": "1"}),
        },
        coords={
            "direction": list(DIRECTIONS),
            "speed": ("speed", speeds, {"units": "rad/s"}),
            "order": ("order", order, {"units": "mesh orders"}),
        },
        attrs={
            "schema": "gearbench-sweep/1",
            "model": case.simulation.model,
            "title": solver.title,
            "torque_mean": case.experiment.torque_mean,
            "teeth_driver": case.rig.driver.teeth,
            "iso_resonance_speed": resonance,
            "warnings": _warnings([look for each in looks.values() for look in each]),
        },
    )


def _warnings(looks: list[Look]) -> str:
    """What limits the looks, a line each; empty where nothing does."""
    return "\n".join(filter(None, (_beyond(looks), _hurried(looks))))


def _beyond(looks: list[Look]) -> str:
    """A sentence where the motion went beyond what is modelled; empty where it did not."""
    count = sum(look.beyond_model > 0.0 for look in looks)
    if not count:
        return ""
    return (
        f"at {count} of {len(looks)} speeds teeth overlap beyond the modelled flanks or press harder than modelled"
        " (beyond_model: for which part of the time): what the model says there is beyond its validity; lower"
        " experiment.torque_mean_nm, or damp the rig"
    )


def _hurried(looks: list[Look]) -> str:
    """A sentence where free vibrations were not waited for; empty where they were."""
    count = sum(look.hurried for look in looks)
    if not count:
        return ""
    return (
        f"at {count} of {len(looks)} speeds free vibrations need more than {WAIT * CYCLES} mesh periods to die out to"
        f" {TRANSIENT:g} of their size, and the first look came after that many: more damping settles faster"
    )
