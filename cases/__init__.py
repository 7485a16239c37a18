"""Ready-to-run cases, shipped as TOML."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

__all__ = ["case_files", "case_path"]


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
