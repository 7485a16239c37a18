"""Members on processes: none is lost with a process that dies, none takes the others with it."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from gearbench.bench.study import cluster, processes
from gearbench.bench.study.member import Task, compute
from gearbench.bench.study.processes import compute_here
from gearbench.bench.study.quantities import Ask
from gearbench.cases import read_case
from gearbench.rig import dump_case

ASK = Ask(("te-mean",))


def tasks(count: int) -> list[Task]:
    texts = [dump_case(read_case("quick_lumped", [f"rig.driver.face_width_mm={10 + n}"])) for n in range(count)]
    return [Task(number, text, ASK) for number, text in enumerate(texts)]


def children() -> list[int]:
    return [int(one) for one in Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()]


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are found in /proc")
def test_a_process_that_is_killed_loses_nothing() -> None:
    wanted = tasks(3)
    before = set(children())
    stream = compute_here(wanted, 1)
    found = [next(stream)]
    for process in set(children()) - before:
        os.kill(process, signal.SIGKILL)
    found += list(stream)
    assert sorted(one.number for one in found) == [0, 1, 2]
    assert [one.numbers for one in sorted(found, key=lambda one: one.number)] == [compute(t).numbers for t in wanted]
    assert not set(children()) - before


def test_a_member_that_kills_its_process_becomes_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes.sys, "executable", "/bin/false")
    found = sorted(compute_here(tasks(3), 2), key=lambda one: one.number)
    assert [one.number for one in found] == [0, 1, 2]
    assert all("ended with code 1" in one.sentence and not one.sources and not one.numbers for one in found)


def test_a_case_that_fails_is_a_sentence() -> None:
    assert "is not valid TOML" in compute(Task(0, "rubbish", ASK)).sentence
    light = dump_case(read_case("quick_lumped"))
    assert "load-share needs" in compute(Task(1, light, Ask(("load-share",)))).sentence


@pytest.mark.parametrize("address", ["nonsense", "tcp://host", "http://host:80", "host:99999999"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(processes.BenchError, match="tcp://HOST:PORT"):
        cluster.check_cluster(address)


def test_slurm_without_slurm_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster.shutil, "which", lambda name: None)
    with pytest.raises(processes.BenchError, match="sbatch, which is not on the path"):
        cluster.check_cluster("slurm")


@pytest.mark.parametrize(("package", "address"), [("distributed", "tcp://a:1"), ("dask_jobqueue", "slurm")])
def test_a_missing_package_is_named_with_the_extra(
    package: str, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(processes.BenchError, match=r"gearbench\[distributed\]"):
        cluster.check_cluster(address)
