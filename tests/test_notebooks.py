"""The notebooks run, and what they claim (their own assertions) holds."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "notebooks"


def output_of(notebook: Path, folder: Path) -> str:
    """What a notebook prints, run in a folder of its own."""
    done = subprocess.run(
        [sys.executable, "-P", str(notebook)],
        cwd=folder,
        env=os.environ | {"MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.mark.validation
@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.py")))
def test_notebook_runs(name: str, tmp_path: Path) -> None:
    assert output_of(FOLDER / f"{name}.py", tmp_path)


@pytest.mark.parametrize("notebook", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_notebook_is_percent_format_and_listed(notebook: Path) -> None:
    text = notebook.read_text(encoding="utf-8")
    assert "format_name: percent" in text and text.count("\n# %%") > 4 and "\nassert " in text
    assert f"(notebooks/{notebook.name})" in (FOLDER.parent / "notebooks.md").read_text(encoding="utf-8")
