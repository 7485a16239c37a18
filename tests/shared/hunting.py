"""Examples carried out one after another in a process of their own: what says something, dies or hangs is a finding."""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import warnings
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection

import numpy as np

from gearbench.cli import run_command_line
from gearbench.commands.house.checks import Got
from gearbench.shell.failure import BAD_INPUT, DONE

SEED = 20260713
SECONDS = 300.0  # an example that takes longer hangs
Example = Callable[[int], str | None]


def scale() -> float:
    """How many times the row's own number of examples are tried: GEARBENCH_FUZZ, 1 where absent."""
    return float(os.environ.get("GEARBENCH_FUZZ", "1"))


def hunt(example: Example, count: int, seconds: float = SECONDS) -> list[str]:
    """Findings of `example(0)` to `example(count - 1)`, each a line that names its number.

    Processes are forked, so that an example may crash the interpreter, or never end, without ending the hunt.
    """
    findings: list[str] = []
    start = 0
    while start < count:
        here, there = multiprocessing.Pipe(duplex=False)
        child = multiprocessing.get_context("fork").Process(target=_carry_out, args=(example, start, count, there))
        child.start()
        there.close()
        start, last = _listen(here, start, count, seconds, findings)
        if start < count:
            child.kill()
            findings.append(f"{start}: {last}")
            start += 1
        child.join()
    return findings


def _listen(here: Connection, start: int, count: int, seconds: float, findings: list[str]) -> tuple[int, str]:
    """The first example without an answer, and why it has none."""
    for number in range(start, count):
        try:
            if not here.poll(seconds):
                return number, f"no end within {seconds:g} s"
            said = here.recv()
        except EOFError:
            return number, "the process died"
        if said is not None:
            findings.append(f"{number}: {said}")
    return count, ""


def _carry_out(example: Example, start: int, count: int, there: Connection) -> None:
    warnings.simplefilter("ignore")
    for number in range(start, count):
        try:
            said = example(number)
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
        there.send(said)
    there.close()


def command(arguments: Sequence[str]) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run_command_line(arguments)
    return code, out.getvalue(), err.getvalue()


def complaint(arguments: Sequence[str]) -> str | None:
    """What is wrong with how a command ended: neither done nor refused in a sentence of its own."""
    code, _, err = command(arguments)
    refusals = [line for line in err.splitlines() if line.startswith("gearbench: ") and "warning: " not in line]
    if code == DONE or (code == BAD_INPUT and len(refusals) == 1 and "Traceback" not in err):
        return None
    return f"exit {code} of `{' '.join(arguments)}`: {err.strip()[-400:]}"


def generator(number: int, row: int) -> np.random.Generator:
    """The stream of one example of one row: any finding can be had again by its number."""
    return np.random.default_rng([SEED, row, number])


def told(findings: list[str], tried: int, of: str) -> Got:
    """Findings as a number, the first ones in words."""
    words = "; ".join(findings[:3])
    return Got(len(findings), f"{tried} {of}" + (f"; {words}" if words else ""))
