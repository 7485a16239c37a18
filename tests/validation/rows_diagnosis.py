"""Diagnosis: time and verdict of one diagnosis, and a small challenge.

The challenge is a spot check of fixed seed on truth rigs of the development family: 15 cases give a point estimate. The
full scoring on fresh seeds of the test family, with its intervals, is logged in benchmarks/diagnosis_log.md.
"""

from __future__ import annotations

import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Any

from gearbench.bench.experiment import simulate
from gearbench.cases import case_path
from gearbench.challenge.making.cases import make_challenge
from gearbench.challenge.making.plan import parse_mix
from gearbench.challenge.scoring.judge import score_folder
from gearbench.challenge.scoring.score import score
from gearbench.commands.house.checks import Check, Got
from gearbench.commands.measured.challenge import diagnose_case, read
from gearbench.diagnosis import Diagnosis, diagnose
from gearbench.records import write_record
from gearbench.rig import Friction, read_case

HIDDEN = 0.06  # coefficient of friction
SEED = 20
MIX = "controls=3,per-effect=1,foreign=3"


@cache
def hidden_friction() -> tuple[Diagnosis, float]:
    """The diagnosis of three conditions of gap_demo with friction in the measured rig, the fourth held out, and the
    processor time that it takes [s] from the files to the values of the verdict."""
    nominal = read_case(case_path("gap_demo"))
    real = nominal.model_copy(
        update={"rig": nominal.rig.model_copy(update={"friction": Friction(coefficient=HIDDEN)})}
    )
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for condition in real.conditions:
            paths.append(Path(folder) / f"measured-{condition.name}.nc")
            write_record(simulate(real.under(condition)), paths[-1])
        before = time.process_time()
        made = diagnose(paths, nominal, held_out="measured-held-out")
        return made, time.process_time() - before


def said(made: Diagnosis) -> str:
    """What a diagnosis says."""
    return "+".join(effect.name for effect in made.verdict.effects) or made.verdict.verdict


def search_time() -> Got:
    """Processor time of the diagnosis [s]."""
    made, spent = hidden_friction()
    return Got(spent, f"says {said(made)}; {len(made.inputs.measurements)} records and one held out")


def search_right() -> Got:
    """1 when the diagnosis names friction and nothing else."""
    made, _ = hidden_friction()
    values = {name: p.value for effect in made.verdict.effects for name, p in effect.parameters.items()}
    more = f", coefficient {values['coefficient']:.3f} for {HIDDEN}" if "coefficient" in values else ""
    return Got(float(said(made) == "friction"), f"says {said(made)}{more}")


def search_gap() -> Got:
    """Rms gap of the transmission error on the held-out record, with the effect over nominal."""
    made, _ = hidden_friction()
    row = next(gap for gap in made.verdict.gap if gap.channel == "dte")
    stages = {
        "nominal": row.nominal,
        "recalibrated": row.recalibrated,
        "with the effect": row.with_effect,
        "floor": row.floor,
    }
    sizes = {name: 1e6 * stage.value for name, stage in stages.items() if stage}
    last = row.with_effect or row.recalibrated
    return Got(last.value / row.nominal.value, "um: " + ", ".join(f"{size:.3g} {name}" for name, size in sizes.items()))


@cache
def small_challenge() -> dict[str, Any]:
    """Score of a small challenge, made and diagnosed here."""
    nominal = read_case(case_path("gap_demo"))
    with tempfile.TemporaryDirectory() as folder:
        cases, answers = Path(folder) / "cases", Path(folder) / "answers.json"
        make_challenge(nominal, parse_mix(MIX), SEED, cases, answers, "development")
        outcomes, _ = score_folder(cases, answers, read, diagnose_case)
    return score(outcomes)


def told(rates: dict[str, Any]) -> str:
    """`right 7, wrong 1` of one kind of cases."""
    return ", ".join(f"{name} {rate['count']}" for name, rate in rates.items() if rate["count"])


def withheld() -> Got:
    """Share of the cases with an effect whose verdict names exactly it."""
    table = small_challenge()
    right = table["effect"]["right"]
    return Got(
        right["share"],
        f"point estimate of {right['total']} cases, the full scoring is logged in benchmarks/diagnosis_log.md;"
        f" effects: {told(table['effect'])}; controls: {told(table['none'])}; foreign: {told(table['foreign'])}",
    )


def accused() -> Got:
    """Controls named an effect and foreign effects blamed on one of the library."""
    table = small_challenge()
    named, blamed = table["none"]["named"], table["foreign"]["blamed"]
    total = named["total"] + blamed["total"]
    return Got(
        (named["count"] + blamed["count"]) / total,
        f"point estimate: {named['count']} controls and {blamed['count']} foreign ones of {total}",
    )


CHECKS = [
    Check("diagnosis-search", "diagnosis of three conditions, processor time", 60.0, "s", search_time),
    Check("diagnosis-search-verdict", "its verdict: 1 right, 0 wrong", 1.0, "", search_right, least=True),
    Check("diagnosis-search-gap", "its held-out gap with the effect over the nominal one", 1.0, "", search_gap),
    Check("diagnosis-withheld", "right on one withheld effect of each kind", 0.75, "", withheld, least=True),
    Check("diagnosis-accused", "an effect named where there is none of the library", 0.1, "", accused),
]
