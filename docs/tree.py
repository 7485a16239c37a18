"""For the site only: the packages as they are installed, in one tree, for a reader that does not import."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path
from typing import Any


def on_config(config: Any) -> None:
    """Before the site is built."""
    root = Path(config.config_file_path).parent
    folders = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["package-dir"]
    tree = root / "build" / "docs-tree"
    shutil.rmtree(tree, ignore_errors=True)
    for name, folder in sorted(folders.items()):
        shutil.copytree(root / folder, tree / name.replace(".", "/"), ignore=shutil.ignore_patterns("__pycache__"))
