"""One diagnosis from records to values: intake, cause, how far the gap shrinks, where it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

from gearbench.bench.refusals.effects import refuse_unknown
from gearbench.bench.refusals.stated import check_springs, check_stated
from gearbench.bench.replays.carried import damped_alike, mesh_damped_alike
from gearbench.diagnosis.account import parts_of, sentences_of_gap
from gearbench.diagnosis.advice import advice_of
from gearbench.diagnosis.cause import find_cause
from gearbench.diagnosis.confirmed import advice_on, confirmed_by_elements
from gearbench.diagnosis.detection.detectable import detectable_of
from gearbench.diagnosis.effects.library import CHANGING, LIBRARY
from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.finding import Finding
from gearbench.diagnosis.forces.nominal import resonance_of
from gearbench.diagnosis.intake.brisk import brisk
from gearbench.diagnosis.intake.creeping import in_step
from gearbench.diagnosis.intake.measurements import Measurement, held_out_of, intake
from gearbench.diagnosis.intake.signals import simulated_channels
from gearbench.diagnosis.odds import Calibration
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.replay.adjustable import Simulate, uncertain, variants
from gearbench.diagnosis.replay.budget import budget
from gearbench.diagnosis.replay.gap import gaps
from gearbench.diagnosis.replay.replays import replays_of
from gearbench.diagnosis.verdict import Confirmed, Detectable, Gap, Probabilities, Share, Verdict
from gearbench.rig import Case, Damping
from gearbench.rig.contract import rank_of

# What the next step is called.
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Inputs:
    """Records taken in: those to diagnose from, the one that is held out, what is asked, and what the decision rests
    on; of a nominal rig of finite elements the resonance [Hz] of what turns on the mesh, at which its damping holds."""

    nominal: Case
    measurements: tuple[Measurement, ...]
    held_out: Measurement | None
    without: tuple[str, ...] = ()
    known: Calibration = POPULATION
    resonance: float | None = None

    @property
    def all(self) -> tuple[Measurement, ...]:
        """All measurements, the held-out one last."""
        return (*self.measurements, *([self.held_out] if self.held_out else []))

    def damped(self, case: Case) -> Case:
        """A case found, with the damping of the mesh said for the nominal rig's own model as well."""
        return case if self.resonance is None else with_damping(case, damped_alike(case.rig.damping, self.resonance))

    @property
    def judged(self) -> Measurement:
        """The measurement that is to judge: the held-out one if its mesh phase is known, else the first."""
        return self.held_out if self.held_out and self.held_out.phase_known else self.measurements[0]

    def of_name(self, name: str) -> Measurement:
        """The measurement of that name, else the one that is to judge."""
        return next((one for one in self.all if one.name == name), self.judged)


@dataclass(frozen=True)
class Diagnosis:
    """The verdict, and the rigs that it compares."""

    inputs: Inputs
    verdict: Verdict
    recalibrated: Case
    with_effect: Case | None

    @property
    def told(self) -> Measurement:
        """The measurement on which the gap is told."""
        return self.inputs.of_name(self.verdict.gap[0].record) if self.verdict.gap else self.inputs.judged

    @property
    def updated(self) -> Case:
        """The rig to go on with: with the effect, if one was found."""
        return self.with_effect or self.recalibrated

    @property
    def stages(self) -> dict[str, Case]:
        """The rigs from the nominal one on, by stage."""
        stages = {"nominal": self.inputs.nominal, "recalibrated": self.recalibrated}
        return stages if self.with_effect is None else {**stages, "with_effect": self.with_effect}


def diagnose(
    records: Sequence[str | Path | xr.Dataset],
    nominal: Case,
    *,
    held_out: str | None = None,
    without: Sequence[str] = (),
    progress: Progress | None = None,
    quick: bool = False,
    confirm: bool = False,
) -> Diagnosis:
    """Where measured records and the nominal rig differ, what causes it, and how far the gap shrinks with it.

    `records`: one of each condition, files or datasets. `held_out` names the record that the result is judged by and
    not found from (absent: the one named "held-out", or of four or more the last); `without` leaves effects out of the
    library; `progress` is told the name of every step as it begins. `quick` leaves out the division of the gap by
    channel, band and so on, and how small an effect would show. `confirm` asks the reduced finite-element model too,
    which takes one to some minutes.

    Raises DiagnosisError or RecordError, one sentence each, for records that cannot be diagnosed.

    >>> import gearbench as gb
    >>> found = gb.diagnose(["none.nc"], gb.read_case("gap_demo"))
    Traceback (most recent call last):
    gearbench.records.errors.RecordError: record none.nc does not exist
    """
    inputs = take_in(records, nominal, held_out=held_out, without=without)
    return diagnosed(inputs, progress, quick=quick, confirm=confirm)


def take_in(
    records: Sequence[str | Path | xr.Dataset],
    nominal: Case,
    *,
    held_out: str | None = None,
    without: Sequence[str] = (),
) -> Inputs:
    """Read and check the records. Raises DiagnosisError, RecordError or BenchError, one sentence each."""
    check_stated(nominal, "a diagnosis")
    check_springs(nominal, "a diagnosis")
    nominal = on_finite_elements(nominal)
    refuse_unknown(nominal.rig)
    names = sorted((effect.name for effect in (*LIBRARY, *CHANGING)), key=rank_of)
    for name in without:
        if name not in names:
            raise DiagnosisError(f"without = {name} is no effect of the library: {', '.join(names)}")
    rest, out = held_out_of([brisk(in_step(one)) for one in intake(records, nominal)], held_out)
    left = tuple(dict.fromkeys(without))
    if nominal.simulation.model == "lumped":
        return Inputs(nominal, rest, out, left)
    resonance = resonance_of(nominal, rest)
    nominal = with_damping(nominal, mesh_damped_alike(nominal.rig.damping, resonance))
    return Inputs(nominal, rest, out, left, resonance=resonance)


def with_damping(case: Case, damping: Damping) -> Case:
    """The case with another damping."""
    return case.model_copy(update={"rig": case.rig.model_copy(update={"damping": damping})})


def on_finite_elements(nominal: Case) -> Case:
    """The case with the mesh law of the lumped model, by which records are replayed, from finite elements where its own
    model is one of them."""
    if nominal.simulation.model == "lumped":
        return nominal
    simulation = nominal.simulation.model_copy(update={"mesh_stiffness": "finite-element"})
    return nominal.model_copy(update={"simulation": simulation})


def diagnosed(
    inputs: Inputs,
    progress: Progress | None = None,
    *,
    doing: Progress = lambda what: None,
    quick: bool = False,
    confirm: bool = False,
) -> Diagnosis:
    """The diagnosis of records that were taken in; arguments as in `diagnose`. `doing` is told what the search for the
    cause is at, by several threads."""
    said = progress or (lambda step: None)
    simulate = replays_of(inputs.nominal, inputs.all)
    said("cause")
    finding = find_cause(inputs.measurements, inputs.nominal, held_out=inputs.held_out, without=inputs.without,
                         report=doing, known=inputs.known)  # fmt: skip
    said("how far the gap shrinks")
    plain = inputs.damped(finding.recalibrated)
    improved = inputs.damped(finding.with_effect) if finding.with_effect is not None else None
    told = inputs.of_name(finding.judged.measured.name) if finding.judged is not None else inputs.judged
    shrunk = gaps(inputs.nominal, plain, improved, told, simulate=simulate)
    where, detectable = finding.where, tuple[Detectable, ...]()
    if not quick:
        said("where the gap is")
        where += _budget(inputs, simulate)
        said("how small an effect would show")
        detectable = _detectable(inputs, finding)
    confirmed = confirmed_by_elements(finding.judged, finding.effects, said) if confirm else None
    return Diagnosis(inputs, _verdict(inputs, finding, told, where, shrunk, confirmed, detectable), plain, improved)


def _budget(inputs: Inputs, simulate: Simulate) -> tuple[Share, ...]:
    nominal, measurements = inputs.nominal, inputs.measurements
    simulated = [simulated_channels(one, simulate(nominal, one.record)) for one in measurements]
    moved = variants(nominal, measurements, uncertain(nominal), simulate)
    return budget(measurements, simulated, nominal, moved)


def _detectable(inputs: Inputs, finding: Finding) -> tuple[Detectable, ...]:
    """How small an effect these records would have shown; nothing where simulation did not decide."""
    if finding.judged is None or finding.problem is None:
        return ()
    try:
        return detectable_of(finding.problem, finding.judged, inputs.measurements, inputs.without)
    except ValueError:  # sizes that no rig may have cost what is said of them, not the verdict
        return ()


def _verdict(
    inputs: Inputs,
    finding: Finding,
    told: Measurement,
    where: tuple[Share, ...],
    shrunk: tuple[Gap, ...],
    confirmed: Confirmed | None,
    detectable: tuple[Detectable, ...],
) -> Verdict:
    advice = (*finding.advice, *advice_of(inputs.measurements, inputs.held_out), *advice_on(confirmed))
    explained, remaining = parts_of(shrunk, finding.missing, finding.places)
    return Verdict(
        verdict=finding.verdict,
        probability=Probabilities(**finding.probability),
        effects=finding.effects,
        candidates=finding.candidates,
        place=finding.place,
        because=(*finding.because, *sentences_of_gap(shrunk, remaining), *(confirmed.because if confirmed else ())),
        explained=explained,
        remainder=remaining,
        structure=finding.structure,
        limits=inputs.known.source,
        calibrated_on=inputs.known.rigs,
        signs=finding.signs,
        where=where,
        gap=shrunk,
        held_out=told.name if told is inputs.held_out else None,
        indistinguishable=finding.indistinguishable,
        detectable=detectable,
        advice=tuple(dict.fromkeys(advice)),
        confirmed=confirmed,
    )
