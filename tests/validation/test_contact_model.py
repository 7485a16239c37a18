"""The contact models that `mesh CASE --out pair.inp` writes, as CalculiX solved them, against our static torque.

The moments are stored; where `ccx` is installed one model is written and solved anew.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shared.contact_models import RUNS, case_of, model_of, stiff_limit

from gearbench.bench.statics import static
from gearbench.geometry.export.calculix import write_deck

# The smallest one; about a minute.
SOLVED = next(run for run in RUNS if run["name"].startswith("z20-21"))


@pytest.mark.validation
@pytest.mark.parametrize("run", RUNS, ids=[run["name"] for run in RUNS])
def test_stored_moments_are_ours(run: dict[str, Any]) -> None:
    model = model_of(run)
    limit = 5e-3 if run["on_line"] else 1e-2
    assert model.on_line == run["on_line"]
    assert model.torques[0] == pytest.approx(stiff_limit(run["driver"]), rel=limit)
    assert model.torques[1] == pytest.approx(stiff_limit(run["driven"]), rel=limit)
    # The model's torque is that of `static` at the same mesh phase and transmission error.
    positions = 100
    cycle = static(case_of(run), dte=[1e-6 * run["dte_um"]], positions=positions)
    at = round(run["phase"] * positions) % positions
    assert cycle["phase"].values[at] == pytest.approx(run["phase"] % 1.0, abs=1e-12)
    assert cycle["torque"].values[0, at] == pytest.approx(model.torques[0], rel=1e-6)


@pytest.mark.validation
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
def test_calculix_finds_the_expected_moment(tmp_path: Path) -> None:
    model = model_of(SOLVED)
    write_deck(tmp_path / "pair.inp", model.deck)
    subprocess.run(["ccx", "pair"], cwd=tmp_path, capture_output=True, check=True)
    text = (tmp_path / "pair.dat").read_text()
    for name, expected in zip(("DRIVER", "DRIVEN"), model.torques, strict=True):
        found = re.findall(rf"set MOMENT_{name} and time\s+\S+\s+(\S+)", text)
        assert len(found) >= 2
        assert stiff_limit([float(found[0]), float(found[-1])]) == pytest.approx(expected, rel=1e-2)
        assert np.sign(float(found[-1])) == 1
