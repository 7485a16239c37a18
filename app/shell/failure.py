"""From what went wrong to one message and an exit code."""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable
from types import FrameType
from typing import TextIO

DONE, DEFECT, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130  # DEFECT: one of ours

# Errors that carry one sentence for the user. Their modules are looked up among those already imported: what
# was not imported cannot have been raised, and importing it here would cost time.
USER_ERRORS = (
    ("gearbench.files.whole", "FileError"),
    ("gearbench.kernels.trust", "CacheError"),
    ("gearbench.rig.errors", "CaseError"),
    ("gearbench.records.errors", "RecordError"),
    ("gearbench.geometry.error", "GeometryError"),
    ("gearbench.geometry.mesh.filling", "MeshingUnavailable"),
    ("gearbench.lumped.errors", "LumpedError"),
    ("gearbench.fem.contact.static", "ContactError"),
    ("gearbench.identification.excitation.comb", "CombError"),
    ("gearbench.identification.excitation.multisine", "MultisineError"),
    ("gearbench.identification.truth.periodic", "PeriodicSystemError"),
    ("gearbench.identification.spectra.joint", "SpectraError"),
    ("gearbench.identification.lpm.local_solve", "LpmError"),
    ("gearbench.identification.response.frf", "FrfError"),
    ("gearbench.records.transmission_error", "TransmissionError"),
    ("gearbench.bench.errors", "BenchError"),
    ("gearbench.challenge.errors", "ChallengeError"),
    ("gearbench.diagnosis.errors", "DiagnosisError"),
    ("gearbench.shell.failure", "InputError"),
)


class InputError(ValueError):
    """Bad input on the command line itself: one sentence that names option, value and limit."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, raised as an exception so that temporary files are removed on the way out."""


def user_errors() -> tuple[type[BaseException], ...]:
    """Those exception classes of USER_ERRORS whose modules are imported."""
    loaded = ((sys.modules.get(module), name) for module, name in USER_ERRORS)
    return tuple(getattr(module, name) for module, name in loaded if module is not None)


def guarded(job: Callable[[], int | None]) -> int:
    """Run a job; print one sentence to stderr when it fails; the process's exit code."""
    previous = signal.signal(signal.SIGTERM, _terminate)
    try:
        code = job() or DONE
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        say("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output (`| head`) has gone: nothing is left to say, nor to flush.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        return report(error)
    finally:
        signal.signal(signal.SIGTERM, previous)


def report(error: Exception) -> int:
    """Say in one sentence what went wrong; the exit code that belongs to it."""
    if os.environ.get("GEARBENCH_DEBUG"):
        traceback.print_exception(error)
    if hasattr(error, "format_message"):  # the command line's own complaints
        if error.format_message():  # empty when help was printed for want of a command
            say(str(error.format_message()))
        return BAD_INPUT
    if isinstance(error, user_errors()):
        say(str(error))
        return BAD_INPUT
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        say(f"{where}{error.strerror}")
        return BAD_INPUT
    place = traceback.extract_tb(error.__traceback__)[-1] if error.__traceback__ else None
    where = f" ({os.path.basename(place.filename)}, line {place.lineno})" if place else ""
    say(f"defect of gearbench: {type(error).__name__}: {_one_line(error)}{where}; GEARBENCH_DEBUG=1 shows all")
    return DEFECT


def show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """A warning of ours as one line to stderr, in place of Python's own form with file and line."""
    say(f"warning: {message}")


def say(sentence: str) -> None:
    """One line to stderr."""
    print(f"gearbench: {sentence}", file=sys.stderr, flush=True)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:300]


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated
