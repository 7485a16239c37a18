"""Studies on a real scheduler: a worker is killed on the way; Slurm's part is played by a shell."""

from __future__ import annotations

import os
import shutil
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import xarray as xr

import gearbench as gb
from gearbench.bench import BenchError
from gearbench.shell.progress import Silent

pytestmark = pytest.mark.validation  # a scheduler and its workers start for seconds

# Members of about a second each, so that a worker dies in the middle of one.
SLOW = [
    "experiment.realisations=8", "experiment.samples_per_period=16384", "experiment.periods=2",
    "experiment.multisine.band_hz=[4,2500]", "identification.band_hz=[4,2500]",
]  # fmt: skip
VARY = ["rig.driver.face_width_mm=10:20:8"]


def dask(*arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-P", "-m", "dask", *arguments], stderr=subprocess.DEVNULL)


@contextmanager
def scheduler(folder: Path) -> Iterator[str]:
    file = folder / "scheduler.json"
    process = dask("scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(file), "--host", "127.0.0.1")
    try:
        until = time.monotonic() + 60
        while not file.exists() and time.monotonic() < until:
            time.sleep(0.1)
        import json

        yield json.loads(file.read_text())["address"]
    finally:
        process.terminate()
        process.wait()


def worker(address: str, folder: Path) -> subprocess.Popen[bytes]:
    return dask("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(folder))


def wait_for_workers(address: str, count: int) -> None:
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(count, timeout=60)


class Killer(Silent):
    """Kills a process once three members are there."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process, self.killed = process, False

    def __call__(self, fraction: float, note: str = "") -> None:
        if note.startswith("3 of") and not self.killed:
            self.killed = True
            os.kill(self.process.pid, signal.SIGKILL)


def test_a_worker_that_is_killed_costs_no_member(tmp_path: Path) -> None:
    alone = gb.campaign("quick_lumped", tmp_path / "alone", VARY, of=["dte-rms"], settings=SLOW, workers=1)
    with scheduler(tmp_path) as address:
        workers = [worker(address, tmp_path) for _ in range(2)]
        try:
            wait_for_workers(address, 2)
            killer = Killer(workers[0])
            asked = {"of": ["dte-rms"], "settings": SLOW, "cluster": address}
            there = gb.campaign("quick_lumped", tmp_path / "there", VARY, **asked, progress=killer)
            assert killer.killed and workers[0].wait() == -signal.SIGKILL and workers[1].poll() is None
        finally:
            for one in workers:
                one.kill()
                one.wait()
    xr.testing.assert_identical(there, alone)
    assert (tmp_path / "there" / "study.csv").read_bytes() == (tmp_path / "alone" / "study.csv").read_bytes()


def test_a_scheduler_without_workers_or_that_dies_is_said(tmp_path: Path) -> None:
    study = {"of": ["dte-rms"], "settings": SLOW}
    with scheduler(tmp_path) as address, pytest.raises(BenchError, match="has no workers: start some"):
        gb.campaign("quick_lumped", tmp_path / "one", VARY, **study, cluster=address)


SBATCH = """#!/bin/sh
# Slurm's sbatch as far as dask-jobqueue knows it: runs the script, prints the number of the job.
setsid sh "$1" >"{folder}/job.log" 2>&1 &
echo $! >>"{folder}/jobs"
cp "$1" "{folder}/script"
echo "Submitted batch job $!"
"""


def test_slurm_jobs_are_asked_for_and_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tools = tmp_path / "bin"
    tools.mkdir()
    for name, text in (("sbatch", SBATCH.format(folder=tmp_path)), ("scancel", "#!/bin/sh\nkill -- -$1\n")):
        (tools / name).write_text(text)
        (tools / name).chmod(0o755 | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{tools}{os.pathsep}{os.environ['PATH']}")
    assert shutil.which("sbatch") == str(tools / "sbatch")
    widths = ["rig.driver.face_width_mm=10:20:4"]
    table = gb.campaign("quick_lumped", tmp_path / "out", widths, of=["te-mean"], cluster="slurm", workers=1)
    assert (table["sentence"].values == "").all() and table.sizes["member"] == 4
    script = (tmp_path / "script").read_text()
    assert "#SBATCH -n 1" in script and "#SBATCH --cpus-per-task=1" in script and "dask" in script
    until = time.monotonic() + 20
    for number in (tmp_path / "jobs").read_text().split():
        while Path(f"/proc/{number}").exists() and time.monotonic() < until:
            time.sleep(0.1)
        assert not Path(f"/proc/{number}").exists()  # the job ends with the study


