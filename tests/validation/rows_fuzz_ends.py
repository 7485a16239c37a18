"""Fuzzing of how a command ends: the disk full at any byte, killed at any moment."""

from __future__ import annotations

import json
import multiprocessing
import os
import resource
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import xarray as xr
from shared.fake_diagnosis import at_rest, friction_found
from shared.fake_verdicts import verdict
from shared.hunting import command, generator, hunt, scale, told
from shared.measured import channels, written
from shared.rectangular import NONLINEAR
from shared.small_run import SMALL_RUN

from gearbench.bench.tape import Shelf
from gearbench.challenge.answers import Answer, read_answers, write_answers
from gearbench.challenge.scoring.judge import score_folder
from gearbench.commands.house.checks import Check, Got
from gearbench.commands.measured.challenge import read
from gearbench.diagnosis import diagnosis as job
from gearbench.diagnosis.verdict import Verdict
from gearbench.diagnosis.verdict_file import read_verdict, write_verdict
from gearbench.files import FileError

KILLS = 2  # of each example, before it is taken up
OFTEN = 0.02  # s from checkpoint to checkpoint, so that a small simulation has some
IDENTIFY = ["--band-hz", "100", "300", "--harmonics", "3", "--order", "1", "--window", "6"]
MIX = "controls=1,per-effect=0,foreign=1,pairs=0"
CASES = ("c1", "c2", "c3", "c4")


@dataclass(frozen=True)
class Job:
    """What ends in products below `folder(home)`: `act(home)` makes them, `ready(home)` comes before, once."""

    name: str
    act: Callable[[Path], int]
    products: Callable[[Path], dict[str, Path]]
    ready: Callable[[Path], None] = lambda home: None


def full_disk() -> Got:
    """Every writer with room for a random part of what it writes: a sentence, and nothing left behind."""
    count = round(30 * scale())
    with tempfile.TemporaryDirectory() as made, _stand_ins():
        folder = Path(made)
        record = folder / "record.nc"
        command(["simulate", *SMALL_RUN, "--out", str(record)])
        static_run = ["static", "quick_lumped", "--positions", "8", "--torque-nm", "50"]
        measured = _measured(folder)
        _challenge(folder / "challenge")
        writers: list[tuple[str, Callable[[Path], list[str]]]] = [
            ("a.nc", lambda out: ["simulate", *SMALL_RUN, "--out", str(out)]),
            ("b.nc", lambda out: ["identify", str(record), "--out", str(out), *IDENTIFY]),
            ("c.nc", lambda out: [*static_run, "--out", str(out)]),
            ("d.png", lambda out: [*static_run, "--out", str(folder / "c.nc"), "--figure", str(out)]),
            ("e.svg", lambda out: [*static_run, "--out", str(folder / "c.nc"), "--figure", str(out)]),
            ("f.dxf", lambda out: ["mesh", "quick_lumped", "--out", str(out)]),
            ("out", lambda out: ["compare", str(record), str(record), "--out", str(out), "--force"]),
            ("run", lambda out: ["run", *SMALL_RUN, "--out", str(out), "--force"]),
            ("diagnosis", lambda out: ["diagnose", *measured, "--rig", "gap_demo", "--out", str(out), "--force"]),
            ("challenge", lambda out: ["score", str(out)]),
        ]
        for name, arguments in writers:
            _carry_out(arguments(folder / name))
        sizes = {name: _largest(folder / name) for name, _ in writers}
        static_size = _largest(folder / "c.nc")

        def example(number: int) -> str | None:
            name, arguments = writers[number % len(writers)]
            least = static_size + 1 if name in ("d.png", "e.svg") else 0
            if name in ("out", "run", "diagnosis"):  # nothing to take up
                shutil.rmtree(folder / name, ignore_errors=True)
            for path in (folder / "challenge").glob("*/verdict.json"):
                path.unlink()
            limit = int(generator(number, 3).integers(least, sizes[name]))
            return _in_room(limit, arguments(folder / name), folder)

        return told(hunt(example, count), count, "writes")


def _carry_out(arguments: list[str]) -> tuple[int, str]:
    """Exit code and standard error of a command, or of the scoring of a folder."""
    if arguments[0] != "score":
        code, _, err = command(arguments)
        return code, err
    try:
        return _score(Path(arguments[1])), ""
    except FileError as error:
        return 2, str(error)


def _largest(path: Path) -> int:
    if path.name == "challenge":
        return max(one.stat().st_size for one in path.glob("*/verdict.json"))
    return max(one.stat().st_size for one in ([path] if path.is_file() else path.iterdir()))


def _in_room(limit: int, arguments: list[str], folder: Path) -> str | None:
    """What is wrong with how a command ends when no file may grow beyond `limit` bytes."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        code, err = _carry_out(arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    left = [str(path) for path in folder.rglob(".gearbench-*")]
    if code == 2 and "cannot be written: File too large" in err and not left:
        return None
    return f"exit {code} with room for {limit} bytes of `{' '.join(arguments)}`, left {left}: {err.strip()[-300:]}"


def kills() -> Got:
    """Commands killed at random moments and given again: the products are those of one that nobody killed."""
    count = round(1 * scale())
    findings: list[str] = []
    with tempfile.TemporaryDirectory() as made, _stand_ins():
        folder = Path(made)
        measured = _measured(folder)
        jobs = (
            Job("simulate", _simulate, lambda home: {"record": home / "r.nc"}),
            Job("sweep", _sweep, lambda home: {"sweep": home / "s.nc"}),
            Job("run", lambda home: command(["run", *SMALL_RUN, "--out", str(home / "run")])[0], _files("run")),
            Job("diagnose", lambda home: _diagnose(measured, home), _files("diagnosis")),
            Job("score", _score_at, _verdicts, lambda home: _challenge(home / "challenge")),
            Job("challenge make", _make, _records),
        )
        for row, one in enumerate(jobs):
            findings += _killed(one, folder / one.name, count, row)
    return told(findings, count * len(jobs), f"products, each killed {KILLS} times on the way")


def _killed(one: Job, folder: Path, count: int, row: int) -> Iterator[str]:
    """What is wrong with the products after kills."""
    whole, usual = folder / "whole", 0.0
    whole.mkdir(parents=True)
    one.ready(whole)
    for _ in range(2):  # the second time all is compiled and in caches, as it is later
        shutil.rmtree(whole)
        whole.mkdir()
        one.ready(whole)
        code, usual = _forked(one, whole)
        if code:
            yield f"{one.name}: exit {code}"
            return
    wanted = one.products(whole)
    for number in range(count):
        rng = generator(number, 100 + row)
        home = folder / str(number)
        home.mkdir()
        one.ready(home)
        for _ in range(KILLS):
            _forked(one, home, float(rng.uniform(0.02, 0.95)) * usual)
        code, _ = _forked(one, home)
        got = one.products(home) if code == 0 else {}
        if code or set(got) != set(wanted):
            yield f"{one.name} {number}: exit {code} of what takes up, {sorted(set(got) ^ set(wanted))} more or less"
            continue
        yield from (f"{one.name} {number}: {name} differs" for name in got if not _same(got[name], wanted[name]))
        left = [path.name for path in home.rglob("*") if path.name.startswith(".") or path.suffix == ".part"]
        if left:
            yield f"{one.name} {number}: {left} left"


def _forked(one: Job, home: Path, seconds: float | None = None) -> tuple[int, float]:
    """Exit code and duration [s] in a process of its own; -9 where it was killed after `seconds`."""
    process = multiprocessing.get_context("fork").Process(target=_exit, args=(one, home))
    started = time.monotonic()
    process.start()
    process.join(seconds)
    if process.is_alive():
        assert process.pid is not None
        os.kill(process.pid, signal.SIGKILL)
    process.join()
    assert process.exitcode is not None
    return process.exitcode, time.monotonic() - started


def _exit(one: Job, home: Path) -> None:
    os._exit(one.act(home))


@contextmanager
def _stand_ins() -> Iterator[None]:
    """A search and a replay whose answers are known, and checkpoints that come often."""
    found: dict[str, Any] = {
        "find_cause": lambda measurements, case, **options: friction_found(case),
        "replays_of": lambda nominal, measurements: at_rest,
    }
    often = OFTEN, *Shelf.__init__.__defaults__[1:]  # type: ignore[index]
    with patch.multiple(job, **found), patch.object(Shelf.__init__, "__defaults__", often):
        yield


def _measured(folder: Path) -> list[str]:
    records = [
        written(folder, "record-base"),
        written(folder, "record-light", channels(torque=40.0, seed=2)),
        written(folder, "record-held-out", channels(torque=80.0, seed=3)),
    ]
    return [str(path) for path in records]


def _simulate(home: Path) -> int:
    return command(["simulate", *SMALL_RUN, "--out", str(home / "r.nc")])[0]


def _sweep(home: Path) -> int:
    settings = [word for setting in (*NONLINEAR, "rig.damping.mesh_ratio=0.1") for word in ("--set", setting)]
    span = ["--from-rpm", "300", "--to-rpm", "900", "--points", "12", "--no-report"]
    return command(["sweep", "rig_62", "--out", str(home / "s.nc"), *span, *settings])[0]


def _diagnose(measured: Sequence[str], home: Path) -> int:
    return command(["diagnose", *measured, "--rig", "gap_demo", "--out", str(home / "diagnosis")])[0]


def _make(home: Path) -> int:
    where = ["--out", str(home / "made"), "--answers", str(home / "answers.json")]
    return command(["challenge", "make", *where, "--seed", "3", "--mix", MIX])[0]


def _challenge(folder: Path) -> None:
    """A folder of cases without verdicts, and its answers."""
    for name in CASES:
        (folder / name).mkdir(parents=True)
    write_answers({name: Answer("none") for name in CASES}, folder.parent / "challenge.json")


def _score(folder: Path) -> int:
    outcomes, failed = score_folder(folder, folder.parent / "challenge.json", read, _found, resume=True, workers=0)
    return int(bool(failed) or len(outcomes) != len(CASES))


def _score_at(home: Path) -> int:
    return _score(home / "challenge")


def _found(records: Sequence[Path], nominal: Path, folder: Path, without: Sequence[str]) -> None:
    """The last step of a diagnosis: its verdict is written. Takes a while, as the steps before do."""
    time.sleep(0.05)
    write_verdict(_nothing(), folder / "verdict.json")


@cache
def _nothing() -> Verdict:
    """A verdict that names nothing; made once, before a disk is full."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "verdict.json"
        source.write_text(json.dumps(verdict("none", place="none")), encoding="utf-8")
        return read_verdict(source)


def _files(name: str) -> Callable[[Path], dict[str, Path]]:
    return lambda home: {path.name: path for path in (home / name).iterdir()}


def _verdicts(home: Path) -> dict[str, Path]:
    return {str(path.relative_to(home)): path for path in (home / "challenge").rglob("*") if path.is_file()}


def _records(home: Path) -> dict[str, Path]:
    """Files of every case by its number in the plan: its name is drawn."""
    answers = read_answers(home / "answers.json")
    paths = (home / "made").glob("*/*")
    return {f"{answers[path.parent.name].number}/{path.name}": path for path in paths}


def _same(one: Path, two: Path) -> bool:
    if one.suffix != ".nc":
        # These name a time, or the folder.
        return one.name in ("run.json", "summary.json", "summary.md") or one.read_bytes() == two.read_bytes()
    first, second = (xr.load_dataset(path, engine="h5netcdf", decode_cf=False) for path in (one, two))
    return bool(first.equals(second))


CHECKS = [
    Check("fuzz-full-disk", "writers that a full disk makes crash, fall silent or leave something", 0, "", full_disk),
    Check(
        "fuzz-kills",
        "products that a kill at a random moment changes: run, simulate, sweep, challenge make; score and diagnose from"
        " their finding on",
        0,
        "",
        kills,
    ),
]
