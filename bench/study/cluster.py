"""Members on the workers of a dask.distributed scheduler, or on jobs that Slurm starts for it."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from gearbench.bench.errors import BenchError
from gearbench.bench.study.member import Found, Task, compute, in_words

CONNECT = 10.0  # s that a scheduler is waited for
FAILURES = 2  # workers that a member may take with it
_ADDRESS = re.compile(r"((tcp|tls|ws|wss|ucx)://)?[^\s:/]+:\d{1,5}")
_EXTRA = "install the extra `distributed`: pip install 'gearbench[distributed]'"


def check_cluster(address: str) -> None:
    """Raise BenchError where no work can be sent to `address`, as far as that shows without asking it."""
    _distributed()
    if address == "slurm":
        _slurm()
    elif not _ADDRESS.fullmatch(address):
        raise BenchError(f"--cluster {address} must be the address of a dask scheduler, tcp://HOST:PORT, or slurm")


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise BenchError(f"--cluster needs the package distributed, which is missing: {_EXTRA}") from error
    return distributed


def _slurm() -> Any:
    """The class of dask-jobqueue's Slurm clusters."""
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError as error:
        raise BenchError(f"--cluster slurm needs the package dask-jobqueue, which is missing: {_EXTRA}") from error
    if shutil.which("sbatch") is None:
        raise BenchError(
            "--cluster slurm needs Slurm's command sbatch, which is not on the path: run it on a login node of the"
            " cluster, or give the address of a scheduler"
        )
    return SLURMCluster


def compute_there(tasks: Iterable[Task], address: str, workers: int) -> Iterator[Found]:
    """Results as they come from the workers of the scheduler at `address`, or of so many Slurm jobs for "slurm".

    A member whose worker dies goes to another one; one that has taken several with it becomes a sentence. Raises
    BenchError where the scheduler cannot be reached or is lost, and where workers cannot import gearbench.
    """
    distributed = _distributed()
    with _scheduler(address, workers) as there:
        try:
            client = distributed.Client(there, timeout=CONNECT, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise BenchError(f"no dask scheduler answers at --cluster {address}: {_short(error)}") from error
        try:
            yield from _gathered(distributed, client, list(tasks), address)
        finally:
            with suppress(Exception):
                client.close(timeout=5)


def _gathered(distributed: Any, client: Any, tasks: list[Task], address: str) -> Iterator[Found]:
    if client.cluster is None and not client.scheduler_info()["workers"]:
        raise BenchError(
            f"the scheduler at --cluster {address} has no workers: start some, `python -m dask worker {address}"
            " --nworkers 2 --nthreads 1`"
        )
    futures = {client.submit(compute, task, pure=False): task.number for task in tasks}
    try:
        for future in distributed.as_completed(list(futures), loop=client.loop):
            try:
                yield future.result()
            except distributed.KilledWorker:
                yield Found(futures[future], {}, "the workers that computed this member died, one after the other")
            except ImportError as error:
                raise BenchError(f"a worker of {address} lacks what members need: {_short(error)}") from error
            except (distributed.CancelledError, OSError) as error:
                raise BenchError(f"the scheduler at --cluster {address} is gone: {_short(error)}") from error
            except Exception as error:  # what the transport makes of a member
                yield Found(futures[future], {}, in_words(error))
            future.release()
    finally:
        with suppress(Exception):
            client.cancel([future for future in futures if not future.done()])


@contextmanager
def _scheduler(address: str, workers: int) -> Iterator[Any]:
    """What a client connects to: an address, or the scheduler of a Slurm cluster of our own."""
    if address != "slurm":
        yield address
        return
    cluster = slurm_cluster()
    try:
        cluster.scale(jobs=workers)
        yield cluster
    finally:
        cluster.close()


def slurm_cluster() -> Any:
    """A scheduler in this process whose workers are Slurm jobs of one processor each, as dask's own configuration
    (jobqueue.slurm: queue, account, memory, walltime, job_script_prologue) has them. Raises BenchError where
    dask-jobqueue or sbatch is missing, or dask-jobqueue refuses that configuration."""
    kind = _slurm()
    import dask

    with dask.config.set({"distributed.scheduler.allowed-failures": FAILURES}):
        asked = {"cores": 1, "processes": 1, "memory": dask.config.get("jobqueue.slurm.memory", None) or "2GB"}
        try:
            return kind(**asked)
        except (ValueError, TypeError) as error:
            raise BenchError(f"dask-jobqueue refuses its configuration jobqueue.slurm: {_short(error)}") from error


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
