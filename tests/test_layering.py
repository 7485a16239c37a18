"""The layers of the packages: who may import whom, and what an import must not drag in."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

# Every package and the packages of ours it may import (besides itself).
MAY_IMPORT: dict[str, set[str]] = {
    "rig": set(),
    "records": set(),
    "cases": set(),
    "geometry": {"rig"},
    "fem": {"rig", "geometry"},
    "lumped": {"rig", "geometry"},
    "identification": {"records"},
    "bench": {"rig", "records", "geometry", "fem", "lumped", "identification", "cases"},
    "diagnosis": {"rig", "records", "geometry", "fem", "lumped", "identification", "bench", "cases"},
    # The truth that diagnosis is tested on: neither knows the other.
    "challenge": {"rig", "records", "geometry", "fem", "lumped", "bench", "cases"},
}
APP = "app"
PACKAGES = sorted({marker.parent.name for marker in ROOT.glob("*/__init__.py")} - {"tests"})
DOTTED = re.compile(r"gearbench(\.\w+)+")


def sources(*folders: str) -> list[Path]:
    """Python files below the folders of the checkout."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def imported(path: Path) -> Iterator[tuple[int, str]]:
    """Line and dotted name of everything a file imports: `import a.b`, `from a import b` (as `a.b`), and
    dotted names of ours in strings, by which lazy imports go. A relative import keeps its dots."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            yield from ((node.lineno, f"{module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and DOTTED.fullmatch(node.value):
            yield node.lineno, node.value


def violations(package: str, path: Path) -> list[str]:
    """Imports of ours in a file of `package` that its layer does not allow."""
    allowed = MAY_IMPORT[package] | {package}
    found = []
    for line, name in imported(path):
        top, *below = name.split(".")
        # The version is a constant of the namespace, which every import of ours loads anyway.
        if top == "gearbench" and below != ["__version__"] and (not below or below[0] not in allowed):
            found.append(f"{path.relative_to(ROOT)}:{line} imports {name}")
    return found


def test_every_package_has_a_layer() -> None:
    assert set(PACKAGES) - {APP} <= set(MAY_IMPORT)
    assert APP in PACKAGES


@pytest.mark.parametrize("package", [name for name in PACKAGES if name != APP])
def test_package_imports_only_lower_layers(package: str) -> None:
    assert [bad for path in sources(package) for bad in violations(package, path)] == []


@pytest.mark.parametrize(
    "line",
    [
        "from gearbench.bench import simulate",
        "import gearbench.fem.contact",
        "from gearbench import run",
        "import gearbench",
        "load = importlib.import_module('gearbench.lumped')",
    ],
)
def test_a_violation_is_seen(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    path = tmp_path / "geometry.py"
    fine = "from gearbench.rig import Rig\nfrom gearbench import __version__\n"
    path.write_text(f"{fine}{line}\n", encoding="utf-8")
    assert len(violations("geometry", path)) == 1
    assert violations("geometry", path)[0].startswith("geometry.py:3 ")


def test_imports_are_absolute_and_namespaced() -> None:
    ours = {*PACKAGES, *MAY_IMPORT, *(path.stem for path in sources(APP) if not path.stem.startswith("__"))}
    bad = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sources(*PACKAGES, "tests", "benchmarks")
        for line, name in imported(path)
        if name.startswith(".") or name.split(".")[0] in ours
    ]
    assert bad == []


def test_only_the_mesher_knows_gmsh() -> None:
    files = {
        path.relative_to(ROOT).as_posix()
        for path in sources(*PACKAGES, "benchmarks")
        for _, name in imported(path)
        if name.split(".")[0] == "gmsh"
    }
    assert files <= {"geometry/mesh.py"}


@pytest.mark.parametrize("package", ["", ".rig", ".records", ".identification"])
def test_import_stays_light(package: str) -> None:
    heavy = ("gmsh", "pyvista", "vtkmodules", "matplotlib.pyplot", "numba")
    code = f"import sys, gearbench{package}; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
