"""Forces and load shares of the teeth in a record: they carry the torque, and are those of statics where it is slow."""

from __future__ import annotations

import numpy as np
import pytest
from shared.twins import supports, twin_case

from gearbench.bench import BenchError, simulate
from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.models import model_for
from gearbench.fem.contact.static import static_cycle
from gearbench.rig import Case

PAIRS = ("leaving", "middle", "entering")


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    return twin_case(tmp_path_factory.mktemp("case"), *supports("1e11", "1e5"), "simulation.outputs=teeth")


def test_teeth_carry_what_they_carry_at_rest(case: Case) -> None:
    record = simulate(case)
    force = {name: record[f"tooth_force_{name}"].values[0] for name in (*PAIRS, "back")}
    share = {name: record[f"load_share_{name}"].values[0] for name in PAIRS}
    assert record["tooth_force_middle"].attrs["units"] == "N" and not force["back"].any()
    assert sum(share.values()) == pytest.approx(1.0)
    phase = record["mesh_phase"].values
    law = elastic_rig(case.rig, case.simulation).law
    chosen = np.arange(3, 512, 16)
    rest = static_cycle(law, phase[0, chosen] if phase.ndim == 2 else phase[chosen], torque=[50.0])
    # Statics tell shares by driver tooth: the largest is that of the pair at the pitch point or its neighbour.
    both = np.sort(np.stack([share[name][chosen] for name in PAIRS], axis=1), axis=1)[:, ::-1]
    truth = np.sort(rest.load_share[0], axis=1)[:, ::-1]
    width = min(both.shape[1], truth.shape[1])
    assert both[:, :width] == pytest.approx(truth[:, :width], abs=5e-3)
    # Driving and driven gear are alike, so that what leaves is what enters, mirrored in time.
    single = np.abs(phase.ravel()[:512] - np.round(phase.ravel()[:512])) < 0.1
    assert force["middle"][single] * law.driver.rb == pytest.approx(50.0, rel=2e-3)
    now = phase.ravel()[:512] % 1.0
    assert np.all(force["entering"][(now > 0.02) & (now < 0.15)] == 0.0)
    assert force["entering"][(now > 0.4) & (now < 0.48)].min() > 100.0
    assert force["leaving"][(now > 0.52) & (now < 0.6)].min() > 100.0


def test_lumped_pairs_have_none(case: Case) -> None:
    with pytest.raises(BenchError, match=r'simulation.outputs = "teeth" needs tooth pairs'):
        model_for(case, "lumped")
