"""The public face: which names `import gearbench` has, that they load late, and that their examples are true."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest
from shared.examples import failures
from shared.members_here import members_here

import gearbench

ROOT = Path(__file__).resolve().parent.parent

# What users may rely on: every public name; of functions the parameters. A change here is a change of the interface.
FUNCTIONS: dict[str, tuple[str, ...]] = {
    "animate": ("case", "out", "torque", "record", "frames", "cycles", "progress"),
    "campaign": (
        "case", "out", "vary", "of", "sample", "size", "seed", "torque", "positions", "cycles", "against",
        "settings", "workers", "cluster", "force", "progress",
    ),
    "compare": ("a", "b"),
    "convert": ("files", "channel_map", "case", "condition", "progress"),
    "diagnose": ("records", "nominal", "held_out", "without", "progress", "quick", "confirm"),
    "dte": ("record",),
    "dump_case": ("case",),
    "force": ("record",),
    "htf": ("dataset",),
    "identify": ("records", "settings", "progress"),
    "itf": ("dataset",),
    "make_record": ("channels", "attributes", "channel_attributes", "start"),
    "optimise": (
        "case", "vary", "quantity", "torques", "over", "settings", "positions", "cycles", "out", "workers", "force",
        "progress",
    ),
    "read_case": ("source", "overrides"),
    "read_frf": ("path",),
    "read_record": ("path",),
    "run": ("case", "out", "force", "progress", "workers"),
    "simulate": ("case", "model", "progress", "checkpoints", "workers"),
    "simulate_to": ("case", "path", "model", "progress", "checkpoints", "workers"),
    "static": ("case", "model", "torque", "dte", "positions", "cycles", "progress"),
    "validate_record": ("record",),
    "write_frf": ("dataset", "path"),
    "write_record": ("record", "path"),
}
VALUES = {"Case", "Comparison", "IdentificationSettings"}
TOP_PACKAGES = (
    "bench",
    "cases",
    "challenge",
    "diagnosis",
    "fem",
    "geometry",
    "identification",
    "kernels",
    "lumped",
    "records",
    "rig",
)


def test_public_names_are_these() -> None:
    assert set(gearbench.__all__) == set(FUNCTIONS) | VALUES
    assert set(dir(gearbench)) == {*gearbench.__all__, *TOP_PACKAGES, "__version__"} - {"kernels"}
    for name in VALUES:
        assert inspect.isclass(getattr(gearbench, name))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_parameters_are_these(name: str) -> None:
    assert tuple(inspect.signature(getattr(gearbench, name)).parameters) == FUNCTIONS[name]


def test_a_name_that_is_none_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="simulat"):
        gearbench.simulat  # noqa: B018
    assert not hasattr(gearbench, "importlib")


def run_python(code: str) -> str:
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_every_name_has_one_home() -> None:
    assert sorted(gearbench._HOMES) == sorted(gearbench.__all__)
    for name, home in gearbench._HOMES.items():
        assert getattr(gearbench, name) is getattr(import_module(home), name)


def test_import_loads_nothing() -> None:
    heavy = ("gmsh", "pyvista", "matplotlib", "numba", "xarray", "numpy", "gearbench.rig")
    code = f"import sys, gearbench; dir(gearbench); print([name for name in {heavy} if name in sys.modules])"
    assert run_python(code) == "[]"


def test_names_are_there_from_the_start() -> None:
    """Sub-packages and functions are reached by attribute, without an import of their own."""
    code = "import gearbench as gb; print(gb.cases.case_path('quick_fe').name, gb.read_case.__name__)"
    assert run_python(code) == "quick_fe.toml read_case"


# `run` takes longest: tests/app/commands/experiments/test_run.py holds its example against a run that it has anyway.
@pytest.mark.parametrize("name", sorted(FUNCTIONS.keys() - {"run"}))
def test_example_is_true(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    members_here(monkeypatch)
    assert failures(getattr(gearbench, name), name) == (0, True)


def test_what_the_readme_says_of_python_runs(capsys: pytest.CaptureFixture[str]) -> None:
    section = (ROOT / "README.md").read_text(encoding="utf-8").split("\n## In Python\n")[1].split("\n## ")[0]
    code = "\n".join(line[4:] for line in section.splitlines() if line.startswith("    "))
    assert code.startswith("import gearbench as gb\n")
    exec(compile(code, "README.md", "exec"), {})
    assert re.fullmatch(r"1[12]\d\d\.\d+ Hz, expected error 0\.\d+\n", capsys.readouterr().out)


def test_a_false_example_is_seen() -> None:
    def half(number: float) -> float:
        """Half of it.

        >>> 6 / 2
        2.0
        """
        return number / 2

    assert failures(half, "half") == (1, False)


@pytest.mark.parametrize("package", TOP_PACKAGES)
def test_packages_say_what_is_public(package: str) -> None:
    module = import_module(f"gearbench.{package}")
    assert module.__doc__ and module.__doc__.strip() != module.__name__
    assert all(hasattr(module, name) for name in module.__all__)
    assert len(set(module.__all__)) == len(module.__all__)
    # What is imported for its own use has a name of its own or is a module.
    loose = {
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and name not in module.__all__
        and getattr(value, "__module__", "") == module.__name__
    }
    assert loose == set()


@pytest.mark.parametrize("package", TOP_PACKAGES)
def test_packages_say_what_is_in_which_room(package: str) -> None:
    said = import_module(f"gearbench.{package}").__doc__ or ""
    rooms = {marker.parent.name for marker in (ROOT / package).glob("*/__init__.py")}
    assert {room for room in rooms if f"`{room}`" not in said} == set()
