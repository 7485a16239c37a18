"""Kept machine code: never older than what it depends on, found again otherwise, made anew when damaged."""

from __future__ import annotations

import ast
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import types
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from gearbench.kernels.compiled import INNER, OPTIONS, ROUNDING, compiled
from gearbench.kernels.folders import KEPT
from gearbench.kernels.identity import identity

ROOT = Path(__file__).resolve().parents[2]

# A small package: `kernel` calls a function of `called` and reads numbers and named tuples of `written`.
WRITTEN = """
from typing import NamedTuple

FACTOR, OFFSET = 2.0, 1.0
TABLE = (1.0, 2.0)

class Spring(NamedTuple):
    stiffness: float
    length: float

class Made(NamedTuple):
    large: float
    small: float
"""
CALLED = """
from gearbench.kernels.compiled import compiled
from small_written import FACTOR, Made

@compiled
def scaled(x: float) -> float:
    "Much."
    return FACTOR * x

@compiled
def both(x: float) -> Made:
    return Made(100.0 * x, x)
"""
KERNEL = """
from gearbench.kernels.compiled import compiled
from small_called import both, scaled
from small_written import OFFSET, TABLE

@compiled
def run(x, spring):
    return scaled(x) + OFFSET + 10.0 * TABLE[1] + 1000.0 * spring.stiffness + both(x).large
"""
SOURCES = {"small_written": WRITTEN, "small_called": CALLED, "small_kernel": KERNEL}
EDITS = [
    ("small_written", "FACTOR, OFFSET = 2.0, 1.0", "FACTOR, OFFSET = 3.0, 1.0", 1.0),
    ("small_written", "FACTOR, OFFSET = 2.0, 1.0", "FACTOR, OFFSET = 2.0, 5.0", 4.0),
    ("small_written", "TABLE = (1.0, 2.0)", "TABLE = (1.0, 4.0)", 20.0),
    # The first is filled by name, the second by place.
    ("small_written", "stiffness: float\n    length: float", "length: float\n    stiffness: float", 0.0),
    ("small_written", "large: float\n    small: float", "small: float\n    large: float", -99.0),
    ("small_called", "return FACTOR * x", "return FACTOR * x + 0.5", 0.5),
    ("small_called", "Made(100.0 * x, x)", "Made(x, 100.0 * x)", -99.0),
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with the small package and a cache of its own."""
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path / "cache"))
    for name, text in SOURCES.items():
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    yield tmp_path
    for name in SOURCES:
        sys.modules.pop(name, None)


def load(folder: Path) -> types.ModuleType:
    """The small package as a new process would import it; its last module."""
    for name in SOURCES:
        spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
        assert spec and spec.loader
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        # Not `exec_module`: it would read byte code, which an edit within the same second does not renew.
        exec(compile((folder / f"{name}.py").read_bytes(), folder / f"{name}.py", "exec"), vars(module))
    return module


def run(folder: Path) -> tuple[float, int]:
    """What the small package computes, and how many compiled signatures it found on disk."""
    module = load(folder)
    spring = sys.modules["small_written"].Spring(stiffness=3.0, length=7.0)
    return module.run(1.0, spring), sum(module.run.stats.cache_hits.values())


def edit(folder: Path, name: str, old: str, new: str) -> None:
    path = folder / f"{name}.py"
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_machine_code_is_kept(folder: Path) -> None:
    assert run(folder) == (3123.0, 0)
    assert run(folder) == (3123.0, 1)


@pytest.mark.parametrize(("name", "old", "new", "change"), EDITS)
def test_an_edit_in_another_file_is_seen(folder: Path, name: str, old: str, new: str, change: float) -> None:
    before, _ = run(folder)
    edit(folder, name, old, new)
    assert run(folder) == (before + change, 0)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("small_written", "FACTOR, OFFSET = 2.0, 1.0", "FACTOR, OFFSET = 2.0, 1.0\nOTHER = 3"),
        ("small_called", "Much.", "More."),
        ("small_called", "@compiled\ndef scaled", "def other() -> None: ...\n\n@compiled\ndef scaled"),
    ],
)
def test_an_edit_that_changes_nothing_read_costs_nothing(folder: Path, name: str, old: str, new: str) -> None:
    before, _ = run(folder)
    edit(folder, name, old, new)
    assert run(folder) == (before, 1)


def test_no_more_than_a_few_states_are_kept(folder: Path) -> None:
    for number in range(KEPT + 2):
        edit(folder, "small_written", f"FACTOR, OFFSET = {2 + number}.0", f"FACTOR, OFFSET = {3 + number}.0")
        run(folder)
    states = folder / "cache" / "compiled" / "small_kernel.run"
    assert len(list(states.iterdir())) == KEPT
    # The first of those states was used last: it stays when the next one comes.
    edit(folder, "small_written", f"FACTOR, OFFSET = {2 + KEPT + 2}.0", "FACTOR, OFFSET = 5.0")
    assert run(folder)[1] == 1
    edit(folder, "small_written", "FACTOR, OFFSET = 5.0", "FACTOR, OFFSET = 1.0")
    assert run(folder)[1] == 0
    edit(folder, "small_written", "FACTOR, OFFSET = 1.0", "FACTOR, OFFSET = 5.0")
    assert run(folder)[1] == 1


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("left", [0, 0.5])
def test_damaged_files_are_made_anew(folder: Path, kind: str, left: float) -> None:
    before, _ = run(folder)
    damaged = list((folder / "cache" / "compiled" / "small_kernel.run").rglob(f"*.{kind}"))
    assert damaged
    for path in damaged:
        content = path.read_bytes()
        path.write_bytes(content[: int(left * len(content))])
    assert run(folder) == (before, 0)
    assert run(folder) == (before, 1)


def test_code_that_is_removed_while_in_use_is_made_anew(folder: Path) -> None:
    module = load(folder)
    shutil.rmtree(folder / "cache")
    spring = sys.modules["small_written"].Spring(stiffness=3.0, length=7.0)
    assert module.run(1.0, spring) == 3123.0


def test_without_a_cache_nothing_is_kept_elsewhere(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "file").write_text("not a folder", encoding="utf-8")
    monkeypatch.setenv("GEARBENCH_CACHE", str(folder / "file"))
    assert run(folder) == run(folder) == (3123.0, 0)
    assert not list(folder.rglob("*.nb?"))


@pytest.mark.usefixtures("folder")
def test_options_are_kept_and_told_apart() -> None:
    def double(x: float) -> float:
        return 2.0 * x

    strict, free = compiled(double), compiled(fastmath=ROUNDING)(double)
    assert {name: strict.targetoptions[name] for name in OPTIONS} == OPTIONS
    assert free.targetoptions["fastmath"] == ROUNDING
    assert identity(double, OPTIONS) != identity(double, OPTIONS | {"fastmath": ROUNDING})


@pytest.mark.parametrize(
    ("edited", "reason"),
    [
        ("return below(FACTOR, x)", "reads below, which is defined only below it"),
        ("return FACTOR * numbers[0]", "reads numbers, which is a list"),
        ("return plain(FACTOR, x)", "reads plain, which is a function"),
    ],
)
def test_what_cannot_be_followed_is_refused(folder: Path, edited: str, reason: str) -> None:
    edit(folder, "small_called", "return FACTOR * x", edited)
    edit(folder, "small_called", "import FACTOR, Made", "import FACTOR, Made\nnumbers = [2.0]\ndef plain(a, b): ...")
    with pytest.raises(TypeError, match=reason):
        load(folder)


def test_nothing_is_compiled_otherwise() -> None:
    files = {
        path.relative_to(ROOT).as_posix()
        for marker in ROOT.glob("*/__init__.py")
        for path in marker.parent.rglob("*.py")
        if "numba" in (text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if (isinstance(node, ast.Import) and any(one.name.split(".")[0] == "numba" for one in node.names))
        or (isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "numba")
    }
    assert files == {"kernels/borrowed.py", "kernels/compiled.py", "kernels/identity.py"}


# The mesh force of the non-linear lumped model at one entry of its table, whose fields two files know.
LUMPED = """
import numpy as np
from gearbench.lumped.nonlinear.constants import Constants
from gearbench.lumped.nonlinear.forces import entry, mesh
from gearbench.lumped.nonlinear.tables import Table

values = dict(position=1.5, excess=2e-6, excess_rate=0.0, gain=1.2, ripple=7.0, back=3e-6)
columns = {name: np.array([value]) for name, value in values.items()}
table = Table(**columns, first_pair=np.zeros(1), own=np.empty((0, 3)))
secant = np.linspace(1e8, 2e8, 12).reshape(3, 4)
constants = dict.fromkeys(Constants._fields, 0.0) | {"root": 1e3, "damping_factor": 2.0}
print(float(mesh(8e-6, 0.1, entry(table, 0), secant, (), Constants(**constants))))
"""
COLUMNS = (
    "    excess: Array  # a [m]\n",
    "    excess_rate: Array  # a' [m/s]\n",
    "    gain: Array  # of the force\n",
)


@pytest.mark.validation
def test_the_lumped_model_sees_its_columns_change_places(tmp_path: Path) -> None:
    package = tmp_path / "gearbench"
    shutil.copytree(ROOT / "app", package)
    for name in ("rig", "geometry", "kernels", "lumped"):
        shutil.copytree(ROOT / name, package / name, ignore=shutil.ignore_patterns("__pycache__"))
    environment = os.environ | {"PYTHONPATH": str(tmp_path), "GEARBENCH_CACHE": str(tmp_path / "cache")}

    def result() -> float:
        done = subprocess.run(
            [sys.executable, "-P", "-c", LUMPED], env=environment, capture_output=True, text=True, check=True
        )
        return float(done.stdout)

    before = result()
    tables = package / "lumped" / "nonlinear" / "tables.py"
    text = tables.read_text(encoding="utf-8")
    assert text.count("".join(COLUMNS)) == 1
    tables.write_text(text.replace("".join(COLUMNS), "".join(reversed(COLUMNS))), encoding="utf-8")
    assert result() == before > 0


EVERY = """
import importlib, json, pkgutil, sys
import gearbench.fem, gearbench.kernels, gearbench.lumped

found = {}
for package in (gearbench.fem, gearbench.kernels, gearbench.lumped):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        for name, value in vars(importlib.import_module(module.name)).items():
            plain = getattr(value, "py_func", None)
            if plain is not None:
                found[plain.__module__ + "." + name] = plain.__dict__["identity"]
"""


def test_every_kernel_is_found_again_by_the_next_process() -> None:
    """Sets come in another order there: its hashes have another seed."""
    here: dict[str, dict[str, str]] = {}
    exec(EVERY, here)
    code, seed = EVERY + "json.dump(found, sys.stdout)", "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    done = subprocess.run(
        [sys.executable, "-P", "-c", code],
        env=os.environ | {"PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    one, two = here["found"], json.loads(done.stdout)
    assert len(one) > 50
    assert [name for name in one if one[name] != two[name]] == []


@compiled(**INNER)
def _doubled(values):
    return 2.0 * values


@compiled
def _quadrupled(values):
    return _doubled(_doubled(values))


def test_function_without_entrance_answers_python_too() -> None:
    values = np.arange(3.0)
    assert _quadrupled(values).tolist() == [0.0, 4.0, 8.0]
    # Twice: before and after the compilation that has an entrance.
    assert _doubled(values).tolist() == _doubled(values).tolist() == [0.0, 2.0, 4.0]
    assert _doubled(1.5) == 3.0


@compiled
def _rounded(value):
    return (value + 1e16) - 1e16


@compiled(fastmath=ROUNDING)
def _asked_in_haste(value):
    return _rounded(value)


def test_fast_mathematics_is_not_inherited() -> None:
    """1e16 swallows the 1, whoever calls first; sums in any order would give it back. Numba hands such freedom down to
    what says nothing of it."""
    assert _asked_in_haste(1.0) == _rounded(1.0) == 0.0
