"""What run-out does to the mesh, on the lumped model and on finite elements."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import simulate
from gearbench.cases import case_files
from gearbench.rig import Case, Sensors, read_case

SHAFT = 8  # lines of the shaft orders of a period


@pytest.fixture(scope="module")
def quiet() -> Case:
    case = read_case(case_files()["gap_demo"])
    return case.model_copy(update={"rig": case.rig.model_copy(update={"sensors": Sensors()})})


def with_runout(case: Case, side: str) -> Case:
    gear = getattr(case.rig, side).model_copy(update={"runout": 40e-6, "runout_phase": 0.7})
    return case.model_copy(update={"rig": case.rig.model_copy(update={side: gear})})


def beyond_shafts(record: xr.Dataset, case: Case, channel: str) -> Any:
    """Half-spectrum of the first period without the shafts' own orders."""
    samples = case.experiment.samples_per_period
    return np.fft.rfft(record[channel].values.reshape(-1)[:samples])[SHAFT + 1 :]


@pytest.mark.parametrize("side", ["driver", "driven"])
def test_runout_makes_the_sidebands_of_the_mesh_that_elements_have(quiet: Case, side: str) -> None:
    """Of a gear's ends of contact. Found: dte 0.28 and 0.21, torque 0.47 and 0.42; 1.00 where contact began and ended
    as on centred gears. What the direction of the force turns by is left."""
    change = {}
    for model in ("lumped", "reduced"):
        case = quiet.model_copy(update={"simulation": quiet.simulation.model_copy(update={"model": model})})
        records = [simulate(one) for one in (case, with_runout(case, side))]
        for channel in ("dte", "torque_driven"):
            before, after = (beyond_shafts(one, case, channel) for one in records)
            change[model, channel] = after - before
    for channel, within in (("dte", 0.35), ("torque_driven", 0.55)):
        elements = change["reduced", channel]
        off = np.linalg.norm(change["lumped", channel] - elements) / np.linalg.norm(elements)
        assert off < within, channel
