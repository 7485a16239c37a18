"""Wheel and source distribution, built from what git tracks and installed into an environment of its own.

Nothing is fetched: setuptools comes with the development packages, and the new environment sees those of this one.
"""

from __future__ import annotations

import json
import os
import shutil
import site
import subprocess
import sys
import tarfile
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

import gearbench
from gearbench.cases import case_files

ROOT = Path(__file__).resolve().parent.parent
LEAST_SETUPTOOLS = 77  # knows licence expressions

pytestmark = [
    pytest.mark.validation,
    pytest.mark.skipif(
        int(version("setuptools").split(".")[0]) < LEAST_SETUPTOOLS, reason="needs setuptools 77, of the extra `dev`"
    ),
]

BUILD = (
    "import os, sys; from setuptools import build_meta as b; os.chdir(sys.argv[1])\n"
    "print(getattr(b, 'build_' + sys.argv[2])(sys.argv[3]))"
)


def build(source: Path, kind: str, target: Path) -> Path:
    """Build a `wheel` or an `sdist` of a source tree with the backend that pyproject.toml names."""
    target.mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, "-P", "-c", BUILD, str(source), kind, str(target)], capture_output=True, text=True, check=True
    )
    return target / done.stdout.splitlines()[-1]


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tracked files of this checkout, elsewhere."""
    place = tmp_path_factory.mktemp("source") / "gearbench"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).exists():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, place / name, follow_symlinks=False)
    return place


@pytest.fixture(scope="module")
def wheel(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel, from the source distribution: both hold what is needed."""
    place = tmp_path_factory.mktemp("built")
    sdist = build(tree, "sdist", place / "sdist")
    with tarfile.open(sdist) as archive:
        archive.extractall(place, filter="data")
    return build(place / sdist.name.removesuffix(".tar.gz"), "wheel", place / "wheel")


def test_wheel_holds_the_package_the_cases_and_nothing_else(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    command = ["git", "ls-files", "*.py", "cases/*.toml", "app/py.typed", "app/report/*.js"]
    tracked = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    outside = ("tests/", "benchmarks/", "tools/", "docs/", "examples/", ".")
    expected = {"gearbench/" + name.removeprefix("app/") for name in tracked if not name.startswith(outside)}
    assert {name for name in names if ".dist-info/" not in name} == expected


def test_installed_command_runs_from_anywhere(wheel: Path, tmp_path: Path) -> None:
    place = tmp_path / "clean"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(place)], check=True)
    packages = next(place.glob("lib/python*/site-packages"))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
    # Dependencies of this environment, without its own gearbench: paths in a .pth file have no .pth files read.
    (packages / "dependencies.pth").write_text("\n".join(others()), encoding="utf-8")
    kept = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONHOME")}

    def run(*arguments: str) -> str:
        command = [str(place / "bin" / "python"), "-P", "-m", "gearbench", *arguments]
        return subprocess.run(command, cwd=tmp_path, env=kept, capture_output=True, text=True, check=True).stdout

    assert run("--version").strip() == gearbench.__version__
    shipped = json.loads(run("cases", "--json"))
    assert set(shipped) == set(case_files())
    assert all(Path(one["path"]).is_relative_to(packages) for one in shipped.values())
    assert "contact ratio" in run("check", "quick_fe")
    entry = (packages / f"gearbench-{gearbench.__version__}.dist-info" / "entry_points.txt").read_text(encoding="utf-8")
    assert "gearbench = gearbench.__main__:main" in entry


def others() -> list[str]:
    """Folders of packages that this environment sees."""
    return [path for path in (*site.getsitepackages(), *sys.path) if "site-packages" in path and Path(path).is_dir()]
