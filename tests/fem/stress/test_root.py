"""Root stress: against the recovered field, halved meshes, its own symmetry."""

from __future__ import annotations

from math import degrees
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.contact.static import solve_torque
from gearbench.fem.stress.fields import ElasticGear, elastic_gear, gear_field
from gearbench.fem.stress.loaded import PairLoad, all_strips, pair_loads, pressed_teeth
from gearbench.fem.stress.recovery import principal
from gearbench.fem.stress.root import RootKernel, peak, root_kernel, root_stress
from gearbench.rig import Material

TORQUE = 120.0


@pytest.fixture(scope="module")
def wheel(unequal: Any) -> ElasticGear:
    return elastic_gear(unequal.rig.driver, Material())


@pytest.fixture(scope="module")
def kernel(wheel: ElasticGear) -> RootKernel:
    return root_kernel(wheel, 0.02)


def loaded(unequal: Any, phase: float, side: int = 0) -> list[PairLoad]:
    found = pair_loads(unequal.law, phase, solve_torque(unequal.law, phase, TORQUE))
    return [PairLoad(side, one.tooth, one.contact, one.force) for one in found]


def polar(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.arctan2(points[:, 1], points[:, 0])


@pytest.mark.parametrize(("phase", "side"), [(0.0, 0), (-0.5, 0), (0.3, 0), (-0.5, 1)])
def test_the_field_has_the_same_stress(
    unequal: Any, wheel: ElasticGear, kernel: RootKernel, phase: float, side: int
) -> None:
    """Nodal stress from inside the elements, of the true pressure: loaded tooth and neighbours, tip corners too."""
    pairs = loaded(unequal, phase, side)
    pressed, _ = pressed_teeth(unequal.law, (unequal.pair.driver, unequal.pair.driven), pairs)
    field = gear_field(wheel, all_strips(20, pressed), range(20))
    radius = np.hypot(*wheel.mesh.points.T)
    edges = wheel.mesh.boundary_edges
    # Not beside the flank, where a contact may be near.
    root = np.unique(edges[radius[edges].max(axis=1) < wheel.shape.form_radius - 6e-4])
    root = root[wheel.mesh.points[root, 1] > 0]
    found, wanted = [], []
    for tooth in (-2, -1, 0, 1, 2):
        sector = -tooth % 20
        stress = field.strips_in(sector).stress(wheel.mesh.points[root]) + field.stress[sector][root]
        both = principal(stress)
        wanted.append(np.where(np.abs(both[:, 0]) > np.abs(both[:, 1]), both[:, 0], both[:, 1]))
        own = root_stress(kernel, pairs, 20, 0, tooth)
        found.append(np.interp(polar(wheel.mesh.points[root]), polar(kernel.points), own))
    largest = np.abs(wanted).max()
    assert largest > 5e7
    np.testing.assert_allclose(found, wanted, atol=0.03 * largest)
    assert np.max(found) == pytest.approx(np.max(wanted), abs=0.01 * largest)


def test_halving_the_mesh(unequal: Any, kernel: RootKernel) -> None:
    fine = root_kernel(elastic_gear(unequal.rig.driver, Material(), 0.125e-3), 0.02)
    for phase in (-0.5, 0.0, 0.3):
        pairs = loaded(unequal, phase)
        for tooth in {p.tooth for p in pairs}:
            coarse, exact = (peak(k, root_stress(k, pairs, 20, 0, tooth)) for k in (kernel, fine))
            assert coarse[0] == pytest.approx(exact[0], rel=8e-3)
            assert coarse[1] == pytest.approx(exact[1], abs=0.1e-3)


def test_bending_lever(kernel: RootKernel) -> None:
    """A force further out pulls more; the peak is where textbooks cut the tooth, near the tangents of 30 degrees."""
    tensions = []
    for s in np.linspace(kernel.s[2], kernel.s[kernel.last], 6):
        value, radius, angle = peak(kernel, kernel.of_moment(0, float(s), 0))
        tensions.append(value)
        assert 25 < degrees(angle) < 60
        assert np.hypot(*kernel.points[-1]) < radius < np.hypot(*kernel.points[0])
    assert np.all(np.diff(tensions) > 0)
    # The tooth beyond the reach is not touched at all.
    assert not kernel.of_moment(0, float(kernel.s[3]), kernel.reach + 1).any()


def test_the_far_teeth_hardly_feel_it(kernel: RootKernel) -> None:
    at = float(kernel.s[kernel.last])
    own = np.abs(kernel.of_moment(0, at, 0)).max()
    felt = [np.abs(kernel.of_moment(0, at, n)).max() / own for n in (1, -1, 3, -3)]
    assert max(felt[2:]) < 0.1 < max(felt[:2]) < 0.6


def test_force_and_lever_enter_linearly(unequal: Any, kernel: RootKernel) -> None:
    (one,) = loaded(unequal, 0.0)
    stress = root_stress(kernel, [one], 20, 0, 0)
    more = PairLoad(0, 0, one.contact._replace(lever1=2 * one.contact.lever1), 3 * one.force)
    np.testing.assert_allclose(root_stress(kernel, [more], 20, 0, 0), 6 * stress)
    later = PairLoad(0, 7, one.contact, one.force)
    np.testing.assert_allclose(root_stress(kernel, [later], 20, 0, 7), stress)
    np.testing.assert_allclose(
        root_stress(kernel, [later], 20, 0, 6), root_stress(kernel, [one], 20, 0, 19), rtol=1e-12, atol=1e-6
    )


def test_on_the_tip_edge_stress_goes_on_from_the_flanks(kernel: RootKernel) -> None:
    """The flank's normal turns away from the axis there, its lever to nothing; stress per moment stays smooth."""
    end, tip = float(kernel.s[kernel.last]), float(kernel.s[-1])
    at_end = kernel.of_moment(0, end, 0).max()
    for part in (0.01, 0.05, 0.1, 0.2, 0.3):
        assert kernel.of_moment(0, end + part * (tip - end), 0).max() == pytest.approx(at_end, rel=0.6 * part + 0.01)
