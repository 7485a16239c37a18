"""The loop in time compiled in a process of its own, while the caller condenses gears and finds static positions.

In a first short run compiling it takes half of the time, and Numba compiles one function at a time in a process. What
either process has compiled the other finds in the folder of kept code; the caller waits only where it needs the loop.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np

from gearbench.bench.elastic.rig import ElasticRig, machine_for
from gearbench.bench.plan.workers import processors
from gearbench.bench.record.attributes import bodies_of
from gearbench.fem.contact.curve import Curve
from gearbench.fem.contact.law import elastic_pair, make_law
from gearbench.fem.gear.body import condense
from gearbench.fem.motion.scheme import make_scheme
from gearbench.fem.motion.transient import compile_for, integrate
from gearbench.kernels.compiled import is_kept
from gearbench.rig import Rig

COARSE = 0.4  # elements of the stand-ins for the gears, in modules


class Ahead:
    """The process that compiles the loop, if there is one."""

    def __init__(self, process: subprocess.Popen[bytes] | None = None) -> None:
        self._process = process

    def wait(self) -> None:
        """Return when the loop has been compiled, or will not be: the caller then compiles what is lacking."""
        if self._process is not None:
            self._process.wait()

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()


@contextmanager
def compiled_ahead(rig: Rig) -> Iterator[Ahead]:
    """The loop in time being compiled for this rig, where it has not been and a processor is free for it."""
    ahead = Ahead() if is_kept(integrate) or processors() < 2 else Ahead(_begin(rig))
    try:
        yield ahead
    finally:
        ahead.end()


def _begin(rig: Rig) -> subprocess.Popen[bytes] | None:
    """A process that compiles the loop; None where it cannot be started."""
    command = [sys.executable, "-P", "-m", "gearbench.bench.elastic.ahead"]
    silent: Any = subprocess.DEVNULL
    with suppress(OSError):
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=silent, stderr=silent, start_new_session=True)
        with process.stdin as pipe:  # type: ignore[union-attr]
            pipe.write(rig.model_dump_json().encode())
        return process
    return None


def compile_ahead(rig: Rig) -> None:
    """Compile the loop in time for this rig: for what it is called with, which depends on neither the size of the
    elements nor the numbers in the curves of the contact law."""
    meshing = elastic_pair(rig)
    one, two = (condense(gear, rig.material, COARSE * gear.module) for gear in (rig.driver, rig.driven))
    flat = np.ones((2, 2))
    curve = Curve(np.array([0.0, 1.0]), flat, flat.copy(), 0.0, 1.0)
    law = make_law(meshing, one, two, rig.material, curves=(curve, curve), gears=(rig.driver, rig.driven))
    machine = machine_for(ElasticRig(rig, meshing, (one, two), bodies_of(rig, meshing), law), 1.0)
    compile_for(machine, make_scheme(1.0, 1.0))


if __name__ == "__main__":
    compile_ahead(Rig.model_validate_json(sys.stdin.buffer.read()))
