"""A mesh whose pairs yield more or less at the ends of their path of contact, or at one: what keeps its mean."""

from __future__ import annotations

import numpy as np
import pytest
from shared.simulated_lines import demonstration

from gearbench.bench.nonlinear.law_table import own_compliance
from gearbench.diagnosis.forces.unknowns import unknowns_of
from gearbench.diagnosis.structure.ends import (
    ENDS,
    ENDS_LARGEST,
    TILT,
    TILT_LARGEST,
    Ends,
    ended,
    ends_groups,
    ends_slope,
    kept_mean,
)
from gearbench.lumped.nonlinear.forms import formed
from gearbench.rig import MeshCorrection

UNKNOWNS = unknowns_of(ends_groups(), 0)
# Two pairs for half of the cycle, one in the middle of its path for the rest; the pairs share compliance.
OWN = np.repeat([[2e8, 2e8], [3e8, 0.0]], 10, axis=0)
MORE = np.stack(
    [np.repeat([[0.4, 0.5], [-0.3, 0.0]], 10, axis=0), np.repeat([[0.9, -0.7], [0.1, 0.0]], 10, axis=0)]
)
SHARED = 1e-9


def stiffness(own: np.ndarray) -> np.ndarray:
    """Of springs side by side and one in series with all."""
    return np.asarray(1.0 / (1.0 / own.sum(axis=1) + SHARED))


MESH = Ends(OWN, MORE, SHARED, float(stiffness(OWN).mean()))


@pytest.mark.parametrize("more", [(-0.8, 0.0), (0.0, 0.0), (0.5, 0.0), (0.0, 0.3), (0.4, -0.3)])
def test_the_mean_stiffness_stays(more: tuple[float, float]) -> None:
    yielding = more[0] * MORE[0] + more[1] * MORE[1]
    own = OWN / (1.0 + yielding / MESH.mean * OWN)
    assert kept_mean(MESH, np.array(more)) * stiffness(own).mean() == pytest.approx(MESH.mean, rel=1e-12)


@pytest.mark.parametrize("more", [(0.6, 0.0), (0.0, 0.5), (0.0, -0.5)])
def test_so_it_does_in_the_law_of_a_rig(more: tuple[float, float]) -> None:
    """Against the table that a rig is simulated with, at the mean load."""
    layout = demonstration().layout
    law, force = layout.model.hardened, abs(layout.model.torque_mean) / layout.model.base_radius[0]

    def mean(both: float, one: float) -> float:
        mesh = MeshCorrection(end_compliance=both / layout.ends.mean, tilt_compliance=one / layout.ends.mean)
        table = formed(law, None, 0.0, own_compliance(law, layout.meshing, mesh))
        tangent = np.diff(table.force, axis=1) / np.diff(table.approach)
        middle = 0.5 * (table.force[:, 1:] + table.force[:, :-1])
        return float(np.mean([np.interp(force, f, t) for f, t in zip(middle, tangent, strict=True)]))

    assert kept_mean(layout.ends, np.array(more)) * mean(*more) == pytest.approx(mean(0.0, 0.0), rel=1e-2)
    assert abs(mean(*more) / mean(0.0, 0.0) - 1.0) > 0.015


def test_the_rig_has_it_beside_its_own() -> None:
    layout = demonstration().layout
    rig, mean = layout.nominal.rig, layout.ends.mean
    here = rig.model_copy(update={"mesh": rig.mesh.model_copy(update={"end_compliance": 2e-10})})
    found = ended(here, layout.ends, UNKNOWNS, np.array([-0.5, 0.2])).mesh
    assert found.end_compliance == pytest.approx(2e-10 - 0.5 / mean)
    assert found.tilt_compliance == pytest.approx(0.2 / mean)
    kept = kept_mean(layout.ends, np.array([-0.5, 0.2]))
    assert found.stiffness_scale == pytest.approx(rig.mesh.stiffness_scale * kept)
    assert ended(here, layout.ends, UNKNOWNS, np.zeros(2)) is here
    assert (UNKNOWNS.group(ENDS).high, UNKNOWNS.group(TILT).high) == (ENDS_LARGEST, TILT_LARGEST)


def test_the_slopes_are_those_of_the_factor() -> None:
    at, step = np.array([0.3, -0.2]), 1e-3
    for slope, one in zip(ends_slope(MESH, at), step * np.eye(2), strict=True):
        wanted = (np.log(kept_mean(MESH, at + one)) - np.log(kept_mean(MESH, at - one))) / (2 * step)
        assert slope == pytest.approx(wanted, rel=1e-5)


def test_pairs_cannot_yield_less_than_nothing() -> None:
    with pytest.raises(ValueError, match=r"cannot have -9 of the mesh's compliance .*, and \+0 at one"):
        kept_mean(MESH, np.array([-9.0, 0.0]))
