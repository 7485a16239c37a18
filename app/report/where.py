"""Where a report lies: beside the result that it shows, or in the folder of a run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gearbench.report.html import GENERATOR
from gearbench.shell.failure import InputError

REPORT = "report.html"
HEAD = 2000  # bytes at the start of a page in which it says who made it


def report_beside(out: Path, others: Sequence[Path | str] = ()) -> Path:
    """The report of a result: NAME.html beside NAME.nc. Raises InputError where that would replace something else."""
    page = out.with_suffix(".html")
    if any(page.resolve() == Path(other).resolve() for other in others):
        raise InputError(f"the report {page} would replace one of the other files: choose another --out")
    if page.exists() and not is_report(page):
        raise InputError(f"{page} is there and no report of gearbench: choose another --out, or add --no-report")
    return page


def is_report(path: Path) -> bool:
    """Whether a file is a page that gearbench made."""
    try:
        with path.open("rb") as file:
            return GENERATOR.encode() in file.read(HEAD)
    except OSError:
        return False


def find_report(path: Path) -> Path:
    """The report that a user means by a folder, a page, or a result beside which it lies. Raises InputError."""
    if not path.exists():
        raise InputError(f"{path} does not exist")
    if path.is_dir():
        if (path / REPORT).is_file():
            return path / REPORT
        pages = sorted(page for page in path.glob("*.html") if is_report(page))
        if len(pages) == 1:
            return pages[0]
        if pages:
            raise InputError(f"{path} holds {len(pages)} reports: name one, as {pages[0]}")
        raise InputError(f"{path} holds no report: run, static, sweep, compare, diagnose and animate write one")
    page = path if path.suffix == ".html" else path.with_suffix(".html")
    if not is_report(page):
        raise InputError(f"{path} is no report of gearbench, and none lies beside it")
    return page
