"""One diagnosis from records to values: intake, cause, how far, where. What is written of it is written elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.figures.diagnosis_gap import Traces

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.diagnosis.intake.measurements import Measurement
    from gearbench.diagnosis.verdict import Share, Verdict
    from gearbench.rig import Case

    Simulate = Callable[[Case, xr.Dataset], xr.Dataset]

# What the next step is called.
Report = Callable[[str], None]


@dataclass(frozen=True)
class Taken:
    """Records taken in: those to diagnose from, the one that is held out, and what is asked."""

    nominal: Case
    measurements: tuple[Measurement, ...]
    held_out: Measurement | None
    without: tuple[str, ...] = ()

    @property
    def judged(self) -> Measurement:
        """The measurement on which the gap is told: the held-out one, else the first."""
        return self.held_out or self.measurements[0]


@dataclass(frozen=True)
class Diagnosis:
    """The verdict, and the rigs that it compares."""

    taken: Taken
    verdict: Verdict
    recalibrated: Case
    with_effect: Case | None

    @property
    def updated(self) -> Case:
        """The rig to go on with: with the effect, if one was found."""
        return self.with_effect or self.recalibrated

    @property
    def stages(self) -> dict[str, Case]:
        """The rigs from the nominal one on, by stage."""
        stages = {"nominal": self.taken.nominal, "recalibrated": self.recalibrated}
        return stages if self.with_effect is None else {**stages, "with_effect": self.with_effect}


def take_in(
    paths: Sequence[Path], nominal: Case, *, held_out: str | None = None, without: Sequence[str] = ()
) -> Taken:
    """Read and check the records. Raises DiagnosisError or RecordError, one sentence each."""
    from gearbench.diagnosis.evidence.hypotheses import LIBRARY
    from gearbench.diagnosis.intake.measurements import held_out_of, intake
    from gearbench.shell.failure import InputError

    for name in without:
        if name not in LIBRARY:
            raise InputError(f"--without {name} is no effect of the library: {', '.join(LIBRARY)}")
    rest, out = held_out_of(intake(paths, nominal), held_out)
    return Taken(nominal, rest, out, tuple(dict.fromkeys(without)))


def diagnose(
    taken: Taken,
    *,
    find: Callable[..., Any] | None = None,
    simulate: Simulate | None = None,
    report: Report = lambda step: None,
    shares: bool = True,
    refine: bool = True,
) -> Diagnosis:
    """The whole diagnosis; without `shares` the budget is left out, without `refine` the rigs of the search are taken
    as they are: both take as long as the search again.

    `find` and `simulate` stand in for the search and the replay (tests).
    """
    search, simulate = find or default_search(), simulate or default_replay(taken)
    report("cause")
    finding = search(taken.measurements, taken.nominal, held_out=taken.held_out, without=taken.without)
    report("how far the gap shrinks")
    from gearbench.diagnosis.replay.gap import gaps

    plain, improved = finding.recalibrated, finding.with_effect
    if refine and taken.judged.phase_known:
        from gearbench.diagnosis.replay.refine import refined

        plain, improved = refined(taken.nominal, finding.add, taken.measurements, simulate)
    shrunk = gaps(taken.nominal, plain, improved, taken.judged, simulate=simulate)
    where = list(finding.where)
    if shares:
        report("where the gap is")
        where += _budget(taken, simulate)
    return Diagnosis(taken, _verdict(taken, finding, where, shrunk), plain, improved)


def default_search() -> Callable[..., Any]:
    """The search for the cause."""
    from gearbench.diagnosis.cause import find_cause

    return find_cause


def default_replay(taken: Taken) -> Simulate:
    """The replay on the non-linear lumped model, with one table of the mesh force for all records."""
    from gearbench.diagnosis.replay.replays import replays_of

    everything = [*taken.measurements, *([taken.held_out] if taken.held_out else [])]
    return replays_of(taken.nominal, everything)


def traces_of(diagnosis: Diagnosis, simulate: Simulate) -> Traces | None:
    """The first channel of the gap table on the record it was told on; None without gaps."""
    from gearbench.diagnosis.intake.signals import (
        UNITS,
        line_energy,
        measured_channels,
        noise_of_mean,
        simulated_channels,
    )

    if not diagnosis.verdict.gap:
        return None
    judged, channel = diagnosis.taken.judged, diagnosis.verdict.gap[0].channel
    rows = measured_channels(judged)[channel]
    noise = line_energy(noise_of_mean(rows)).sum(axis=0) ** 0.5 if len(rows) > 1 else None
    simulated = {
        stage: simulated_channels(judged, simulate(case, judged.record))[channel]
        for stage, case in diagnosis.stages.items()
    }
    rate, mesh = judged.sampling_rate, judged.mesh_frequency
    return Traces(channel, UNITS[channel], rate, mesh, rows.mean(axis=0), simulated, noise)


def _budget(taken: Taken, simulate: Simulate) -> tuple[Share, ...]:
    from gearbench.diagnosis.intake.signals import simulated_channels
    from gearbench.diagnosis.replay.adjustable import uncertain, variants
    from gearbench.diagnosis.replay.budget import budget

    replays = [simulated_channels(one, simulate(taken.nominal, one.record)) for one in taken.measurements]
    moved = variants(taken.nominal, taken.measurements, uncertain(taken.nominal), simulate)
    return budget(taken.measurements, replays, taken.nominal, moved)


def _verdict(taken: Taken, finding: Any, shares: Sequence[Share], shrunk: Sequence[Any]) -> Verdict:
    from gearbench.diagnosis.advice import advice_of
    from gearbench.diagnosis.verdict import Probabilities, Verdict

    advice = (*finding.advice, *advice_of(taken.measurements, taken.held_out))
    return Verdict(
        verdict=finding.verdict,
        probability=Probabilities(**finding.probability),
        effects=tuple(finding.effects),
        candidates=tuple(finding.candidates),
        place=finding.place,
        where=tuple(shares),
        gap=tuple(shrunk),
        held_out=taken.held_out.name if taken.held_out else None,
        indistinguishable=tuple(tuple(group) for group in finding.indistinguishable),
        advice=tuple(dict.fromkeys(advice)),
    )
