"""The layers of the packages: who may import whom, and what an import must not drag in."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

# Every package and the packages of ours it may import, besides itself and `files`, the one writer, which all may.
MAY_IMPORT: dict[str, set[str]] = {
    "rig": set(),
    "records": set(),
    "cases": {"rig"},
    "kernels": set(),
    "files": set(),
    "geometry": {"rig"},
    "fem": {"rig", "geometry", "kernels"},
    "lumped": {"rig", "geometry", "kernels"},
    "identification": {"records"},
    "bench": {"rig", "records", "kernels", "geometry", "fem", "lumped", "identification", "cases"},
    "diagnosis": {"rig", "records", "geometry", "fem", "lumped", "identification", "bench", "cases"},
    # The truth that diagnosis is tested on: neither knows the other.
    "challenge": {"rig", "records", "kernels", "geometry", "fem", "lumped", "bench", "cases"},
}
# Rooms of a package from the lowest to the highest: a file imports from its own room and from lower ones. A package
# that is not named here has no rooms.
ROOMS: dict[str, tuple[str, ...]] = {
    "rig": ("casefile",),
    "records": ("seen", "clocks", "checks", "formats", "conversion"),
    "geometry": ("tooth", "pair", "mesh", "export"),
    "fem": ("gear", "contact", "motion", "full", "stress"),
    "lumped": ("stiffness", "linear", "nonlinear"),
    "bench": (
        *("plan", "record", "refusals", "linear", "elastic", "full", "nonlinear", "replays", "stress", "export"),
        *("results", "study"),
    ),
    "identification": ("excitation", "spectra", "lpm", "smooth", "truth", "response", "feedback", "nonlinear"),
    "diagnosis": (
        *("intake", "forces", "effects", "evidence", "replay", "structure", "simulation", "fitting", "selection"),
        *("remainder", "judging", "detection", "planning"),
    ),
    "challenge": ("truth", "making", "scoring"),
    "app": ("shell", "words", "figures", "report", "commands"),
}
APP = "app"
PACKAGES = sorted({marker.parent.name for marker in ROOT.glob("*/__init__.py")} - {"tests"})
DOTTED = re.compile(r"gearbench(\.\w+)+")


def sources(*folders: str) -> list[Path]:
    """Python files below the folders of the checkout."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


@cache
def imported(path: Path) -> tuple[tuple[int, str], ...]:
    """Line and dotted name of everything a file imports: `import a.b`, `from a import b` (as `a.b`), and
    dotted names of ours in strings, by which lazy imports go. A relative import keeps its dots."""
    return tuple(_imported(ast.walk(ast.parse(path.read_text(encoding="utf-8")))))


def _imported(nodes: Iterator[ast.AST]) -> Iterator[tuple[int, str]]:
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            yield from ((node.lineno, f"{module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and DOTTED.fullmatch(node.value):
            yield node.lineno, node.value


def violations(package: str, path: Path) -> list[str]:
    """Imports of ours in a file of `package` that its layer does not allow."""
    allowed = MAY_IMPORT[package] | {package, "files"}
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


def climbing(package: str, path: Path) -> list[str]:
    """Imports of a file in a room from a room above its own."""
    rooms, inside = ROOMS[package], path.relative_to(ROOT / package).parts
    if len(inside) == 1:
        return []
    depth = 1 if package == APP else 2
    names = [(line, name.split(".")) for line, name in imported(path)]
    ours = [(line, parts) for line, parts in names if parts[0] == "gearbench" and (depth == 1 or package in parts[1:2])]
    above = rooms[rooms.index(inside[0]) + 1 :]
    return [
        f"{path.relative_to(ROOT)}:{line} imports {'.'.join(parts)}"
        for line, parts in ours
        if len(parts) > depth and parts[depth] in above
    ]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_has_a_level(package: str) -> None:
    rooms = {marker.parent.name for marker in (ROOT / package).glob("*/__init__.py")}
    assert rooms == set(ROOMS.get(package, ()))


@pytest.mark.parametrize("package", sorted(ROOMS))
def test_rooms_import_only_lower_rooms(package: str) -> None:
    assert [bad for path in sources(package) for bad in climbing(package, path)] == []


@pytest.mark.parametrize(
    ("package", "line"),
    [
        ("fem", "from gearbench.fem.contact.law import Law"),
        ("fem", "module = 'gearbench.fem.motion.transient'"),
        ("app", "from gearbench.figures.responses.frf import draw"),
    ],
)
def test_an_import_that_climbs_is_seen(
    package: str, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    path = tmp_path / package / ROOMS[package][0] / "file.py"
    path.parent.mkdir(parents=True)
    path.write_text(f"from gearbench.{package}.{ROOMS[package][0]}.other import thing\n{line}\n", encoding="utf-8")
    assert len(climbing(package, path)) == 1


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
    roots = {path.stem for path in (ROOT / APP).glob("*.py") if not path.stem.startswith("__")}
    ours = {*PACKAGES, *MAY_IMPORT, *ROOMS[APP], *roots}
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
    assert files <= {"geometry/mesh/filling.py"}


@pytest.mark.parametrize("package", ["", ".rig", ".records", ".identification"])
def test_import_stays_light(package: str) -> None:
    heavy = ("gmsh", "pyvista", "vtkmodules", "matplotlib.pyplot", "numba")
    code = f"import sys, gearbench{package}; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
