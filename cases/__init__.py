"""Ready-to-run cases, shipped as TOML, and the reading of a case by its file or by its name."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from gearbench.rig import Case, CaseError
from gearbench.rig import read_case as read_file

__all__ = ["case_files", "case_path", "read_case"]


def case_files() -> dict[str, Path]:
    """Name -> file of every shipped case, in alphabetical order."""
    folder = Path(str(files(__name__)))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def case_path(name: str) -> Path:
    """File of one shipped case. Raises KeyError with the names there are."""
    shipped = case_files()
    if name not in shipped:
        raise KeyError(f"no case is called {name!r}; there are {', '.join(shipped)}")
    return shipped[name]


def read_case(source: str | Path, overrides: Sequence[str] = ()) -> Case:
    """The case in a file or, where there is no such file, the shipped case of that name.

    `overrides` are settings `dotted.key=value` that replace keys before the case is checked; the keys carry their
    unit, the case holds SI values. Raises CaseError (one sentence with key, value and limit).

    >>> import gearbench as gb
    >>> case = gb.read_case("quick_lumped", ["rig.driver.face_width_mm=25"])
    >>> case.rig.driver.face_width
    0.025
    """
    path = Path(source)
    if not path.exists():
        shipped = case_files()
        if str(source) not in shipped:
            raise CaseError(f"case file {source} does not exist, and the shipped cases are {', '.join(shipped)}")
        path = shipped[str(source)]
    return read_file(path, overrides)
