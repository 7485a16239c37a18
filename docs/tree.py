"""For the site only: the packages as they are installed, in one tree, for a reader that does not import."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
TREE = ROOT / "build" / "docs-tree"  # plugins.mkdocstrings.handlers.python.paths of mkdocs.yml


def on_startup(**_: Any) -> None:
    """Before plugins are set up: mkdocstrings drops a path that is not there yet, as in a fresh checkout."""
    TREE.mkdir(parents=True, exist_ok=True)


def on_config(config: Any) -> None:
    """Before the site is built."""
    folders = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["package-dir"]
    shutil.rmtree(TREE, ignore_errors=True)
    for name, folder in sorted(folders.items()):
        shutil.copytree(ROOT / folder, TREE / name.replace(".", "/"), ignore=shutil.ignore_patterns("__pycache__"))
