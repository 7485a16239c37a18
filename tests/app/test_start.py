"""What the small commands load: seconds of imports are what one waits for."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = {"numba", "xarray", "pandas", "skfem", "matplotlib", "gmsh", "pyvista", "plotly", "scipy.stats"}
HEAVY |= {"scipy.optimize", "scipy.interpolate"}
OTHERS = {f"gearbench.commands.{one}" for one in ("experiments.run", "gears.static", "measured.diagnose")}


def loaded(*arguments: str) -> set[str]:
    """Modules that a command has loaded when it ends."""
    code = (
        "import sys; from gearbench.cli import run_command_line\n"
        f"code = run_command_line({list(arguments)!r})\n"
        "print('loaded:', code, *sys.modules)"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    words = done.stdout.splitlines()[-1].split()
    assert words[:2] == ["loaded:", "0"], done.stderr
    return set(words[2:])


@pytest.mark.parametrize("case", ["quick_fe", "quick_lumped", "gap_demo"])
def test_check_loads_neither_solvers_nor_datasets(case: str) -> None:
    modules = loaded("check", case)
    assert modules & (HEAVY | {"gearbench.geometry.export.meshes"}) == set()
    assert {name for name in modules if name.startswith("gearbench.commands.")} & OTHERS == set()


def test_help_loads_no_arrays() -> None:
    assert loaded("--help") & (HEAVY | {"numpy", "pydantic", "gearbench.rig"}) == set()
