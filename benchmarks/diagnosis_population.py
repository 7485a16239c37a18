"""Fit the population's calibration of `diagnosis/population.py` to diagnosed challenges, and print it.

    python -P benchmarks/diagnosis_population.py [--onto] DIR ANSWERS [DIR ANSWERS ...]

Folders whose cases have no verdict.json are read as far as they have. With --onto the curves of the present population
are what was known before. Its limits stay: they were set on other rigs.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from gearbench.challenge.answers import read_answers
from gearbench.diagnosis.odds import WIDTHS, Known, Odds, calibrated, nothing_known
from gearbench.diagnosis.population import POPULATION
from gearbench.diagnosis.verdict_file import read_verdict
from gearbench.rig_limits import known_of


def known_in(folder: Path, answers: Path) -> list[Known]:
    """The diagnosed cases of a challenge."""
    found = []
    for name, answer in read_answers(answers).items():
        path = folder / name / "verdict.json"
        if path.is_file():
            found.append(known_of(read_verdict(path), answer))
    return found


def shown(name: str, odds: Odds) -> str:
    """A curve as the code of `population.py`."""
    weights = ", ".join(f"{value:.4g}" for value in odds.weights)
    rows = [f"({', '.join(f'{value:.4g}' for value in row)})" for row in odds.covariance]
    return f"{name} = Odds(({weights}), ({', '.join(rows)}), cases={odds.cases}, true={odds.true})"


def main(arguments: list[str]) -> None:
    """Print both curves, and what the sound rigs left."""
    onto = arguments[:1] == ["--onto"]
    folders = arguments[onto:]
    pairs = zip(folders[::2], folders[1::2], strict=True)
    known = [one for folder, answers in pairs for one in known_in(Path(folder), Path(answers))]
    blank = replace(
        POPULATION, effect=nothing_known(WIDTHS["effect"]), unknown=nothing_known(WIDTHS["unknown"])
    )
    made = calibrated(POPULATION if onto else blank, known, "population")
    print(shown("EFFECT", made.effect))
    print(shown("UNKNOWN", made.unknown))
    print(f"{made.rigs} rigs; sound rigs times the margin: {made.structure:.3g} of a channel's fluctuation left,"
          f" {made.changing:.3g} of the gap changing, {dict(made.outstanding)}")  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1:])
