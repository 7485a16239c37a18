"""The package that is installed is the tree of this checkout, whole and only once described."""

from __future__ import annotations

import tomllib
from fnmatch import fnmatch
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import gearbench

ROOT = Path(__file__).resolve().parent.parent
PYPROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SETUPTOOLS: dict[str, Any] = PYPROJECT["tool"]["setuptools"]
NOT_PACKAGES = {"tests", "benchmarks", "tools", "docs", "build"}


def top_folders() -> set[str]:
    """Folders on top that hold Python files and are not said to be something else."""
    folders = {path.relative_to(ROOT).parts[0] for path in ROOT.glob("*/*.py")}
    return {name for name in folders - NOT_PACKAGES if not name.startswith((".", "out"))}


def package_name(folder: Path) -> str:
    """Name under which a folder is imported: `app` is the namespace itself."""
    parts = folder.relative_to(ROOT).parts
    return ".".join(["gearbench", *(parts[1:] if parts[0] == "app" else parts)])


PACKAGES = {
    package_name(marker.parent): marker.parent
    for top in top_folders()
    for marker in (ROOT / top).rglob("__init__.py")
}


def test_listed_packages_are_the_tree() -> None:
    assert sorted(SETUPTOOLS["packages"]) == sorted(PACKAGES)


def test_every_folder_with_modules_is_a_package() -> None:
    folders = {path.parent for top in top_folders() for path in (ROOT / top).rglob("*.py")}
    assert folders == set(PACKAGES.values())


def test_package_dir_maps_every_top_folder() -> None:
    expected = {package_name(ROOT / top): top for top in top_folders()}
    assert SETUPTOOLS["package-dir"] == expected


def test_no_folder_shadows_the_namespace() -> None:
    assert not (ROOT / "gearbench").is_dir()


@pytest.mark.parametrize("name", sorted(PACKAGES))
def test_imported_package_is_this_checkout(name: str) -> None:
    module = import_module(name)
    assert module.__file__ is not None
    assert Path(module.__file__).resolve() == PACKAGES[name] / "__init__.py"


def test_cases_are_package_data() -> None:
    files = [path.relative_to(ROOT / "cases").as_posix() for path in (ROOT / "cases").rglob("*.toml")]
    patterns = SETUPTOOLS["package-data"]["gearbench.cases"]
    # As setuptools reads the patterns, `*` does not cross a folder.
    shipped = [f for f in files if any(fnmatch(f, p) and f.count("/") == p.count("/") for p in patterns)]
    assert files
    assert shipped == files


def test_version_is_written_once() -> None:
    assert "version" not in PYPROJECT["project"]
    assert SETUPTOOLS["dynamic"]["version"] == {"attr": "gearbench.__version__"}
    homes = [
        path.relative_to(ROOT).as_posix()
        for folder in PACKAGES.values()
        for path in folder.glob("*.py")
        if f'"{gearbench.__version__}"' in path.read_text(encoding="utf-8")
    ]
    assert homes == ["app/__init__.py"]


def test_type_checkers_see_every_package() -> None:
    assert sorted(PYPROJECT["tool"]["mypy"]["packages"]) == sorted(SETUPTOOLS["package-dir"])
    tree = ROOT / "tools" / "typing"
    links = {path.relative_to(tree).as_posix(): path for path in tree.glob("*/*") if path.is_symlink()}
    links |= {path.relative_to(tree).as_posix(): path for path in tree.glob("packages/gearbench/*")}
    expected = {f"packages/gearbench/{top}": ROOT / top for top in top_folders() - {"app"}}
    expected["namespace/gearbench"] = ROOT / "app"
    assert {name: path.resolve() for name, path in links.items()} == expected
    assert not any(path.readlink().is_absolute() for path in links.values())


def test_every_direct_dependency_is_pinned() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    assert all(line.count("==") == 1 for line in pins)
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in pins}
    extras = PYPROJECT["project"]["optional-dependencies"]
    wanted = PYPROJECT["project"]["dependencies"] + extras["dev"] + extras["distributed"] + extras["docs"]
    names = {requirement.split(">=")[0].removesuffix("[python]") for requirement in wanted}
    assert names - {"gearbench[distributed]"} <= pinned
    assert "gearbench" not in pinned


def test_type_checkers_are_told_that_it_is_typed() -> None:
    """The marker on top speaks for all sub-packages (PEP 561)."""
    assert SETUPTOOLS["package-data"]["gearbench"] == ["py.typed"]
    assert (ROOT / "app" / "py.typed").read_bytes() == b""
