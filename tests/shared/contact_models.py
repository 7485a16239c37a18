"""Contact models that `mesh CASE --out pair.inp` wrote, as CalculiX solved them (validation/contact_model.json)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from gearbench.bench.export.calculix import ContactModel, contact_model
from gearbench.cases import case_path
from gearbench.geometry.export.calculix import PENALTIES
from gearbench.rig import Case, read_case

FILE = Path(__file__).parents[1] / "validation" / "contact_model.json"
RUNS: list[dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))["runs"]


def case_of(run: dict[str, Any]) -> Case:
    """The case of a stored run."""
    return read_case(case_path(run["case"]), run["settings"])


def model_of(run: dict[str, Any]) -> ContactModel:
    """Our model of a stored run, with the torques that we expect."""
    return contact_model(case_of(run), run["phase"], dte=1e-6 * run["dte_um"])


def stiff_limit(moments: list[float]) -> float:
    """Moment [N m] without the softness of the penalty, in whose reciprocal it is linear."""
    soft, stiff = (1 / penalty for penalty in PENALTIES)
    return 1e-3 * (moments[1] + (moments[1] - moments[0]) * stiff / (soft - stiff))


def difference(run: dict[str, Any]) -> float:
    """Larger relative difference of the torques of driver and driven gear from those of a stored run."""
    return max(
        abs(ours / stiff_limit(run[name]) - 1)
        for name, ours in zip(("driver", "driven"), model_of(run).torques, strict=True)
    )
