"""Fuzzing: whatever is put in, an answer that holds or one sentence. GEARBENCH_FUZZ=40 tries the full numbers."""

from __future__ import annotations

import tempfile
from pathlib import Path

from hypothesis import strategies as st
from shared.hunting import command, complaint, generator, hunt, scale, told
from shared.mutations import damaged_record, leaves, settings
from shared.small_run import SMALL_RUN

from gearbench.cases import read_case
from gearbench.commands.house.checks import Check, Got
from gearbench.records import read_record

BASES = ("quick_lumped", "quick_fe", "gap_demo", "paper_lumped", "reference")

def cases() -> Got:
    """Cases with keys changed, and texts of any kind, through `check`."""
    known = {base: leaves(read_case(base)) for base in BASES}
    texts = st.text(max_size=30)
    count = round(250 * scale())

    def example(number: int) -> str | None:
        rng = generator(number, 0)
        base = str(rng.choice(BASES))
        chosen = settings(rng, known[base])
        if number % 5 == 0:
            key = str(rng.choice(list(known[base])))
            chosen.append(f"{key}={text_of(texts, number)}" if number % 2 else text_of(texts, number))
        return complaint(["check", base, *(part for one in chosen for part in ("--set", one))])

    return told(hunt(example, count), count, "cases")


def text_of(strategy: st.SearchStrategy[str], number: int) -> str:
    """A text that hypothesis finds worth trying; the same for the same number."""
    from hypothesis import HealthCheck, Phase, given, seed
    from hypothesis import settings as how

    found: list[str] = []

    @seed(number)
    @how(max_examples=3, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck), deadline=None)
    @given(strategy)
    def draw(text: str) -> None:
        found.append(text)

    draw()
    return found[-1].replace("\x00", "")


def records() -> Got:
    """Damaged records through `identify`, `compare` and `diagnose`."""
    count = round(50 * scale())
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        whole = folder / "whole.nc"
        command(["simulate", *SMALL_RUN, "--out", str(whole)])
        record, content = read_record(whole), whole.read_bytes()
        hurt = folder / "hurt.nc"

        def example(number: int) -> str | None:
            kind = damaged_record(generator(number, 2), record, content, hurt)
            options = ["--band-hz", "100", "300", "--harmonics", "3", "--order", "1", "--window", "6"]
            commands = (
                ["identify", str(hurt), "--out", str(folder / "frf.nc"), *options],
                ["compare", str(whole), str(hurt), "--out", str(folder / "out"), "--force"],
                ["diagnose", str(hurt), "--rig", "quick_lumped", "--out", str(folder / "diagnosis"), "--force"],
            )
            wrong = complaint(commands[number % 3])
            return f"{kind}: {wrong}" if wrong else None

        return told(hunt(example, count), count, "records")


CHECKS = [
    Check("fuzz-cases", "cases and settings that end in neither an answer nor a sentence", 0, "", cases),
    Check("fuzz-records", "damaged records that end in neither an answer nor a sentence", 0, "", records),
]
