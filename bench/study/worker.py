"""`python -m gearbench.bench.study.worker`: a process that computes one member after the other.

A task a line on the standard input, a result a line on the standard output, both JSON. A process of its own, and not
one that is forked or given the caller's main module again, so that a study may be started from a notebook or a script
without ceremony, and a member that kills its process takes nobody with it.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time

_LOOK = 1.0  # s between two looks at whether the study still lives


def main() -> None:
    """Serve until the input ends."""
    # Whatever libraries print must not get between the results.
    results = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    threading.Thread(target=_watch, args=(os.getppid(),), daemon=True).start()
    from gearbench.bench.study.member import compute, found_data, task_from

    for line in sys.stdin:
        found = compute(task_from(json.loads(line)))
        results.write(json.dumps(found_data(found)) + "\n")
        results.flush()


def _watch(parent: int) -> None:
    """End with the study: one that is killed cannot say goodbye."""
    while os.getppid() == parent:
        time.sleep(_LOOK)
    os._exit(1)


if __name__ == "__main__":
    main()
