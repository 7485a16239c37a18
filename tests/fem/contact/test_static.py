"""Static analysis: equilibrium, mesh independence, smoothness, symmetry and limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.fem.contact.kinematics import ON_LINE
from gearbench.fem.contact.law import PAIRS, make_law
from gearbench.fem.contact.static import ContactError, Equilibrium, position, solve_torque, static_cycle
from gearbench.fem.gear.body import condense
from gearbench.rig import Material

TORQUE = 120.0
FREE = np.zeros(PAIRS)


def held(law: Any, phase: float, dte: float, y1: float = 0.0, x2: float = 0.0) -> Equilibrium:
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    return position(law, theta1, phase * law.driven.pitch, 0.0, y1, x2, 0.0, FREE)


@pytest.fixture(scope="module")
def cycle(unequal: Any) -> Any:
    return static_cycle(unequal.law, np.linspace(-0.5, 0.5, 41), torque=[TORQUE])


def test_torque_ratio_and_moment_balance(unequal: Any, cycle: Any) -> None:
    """z2/z1 where all contacts are on the line of action; moments about one centre cancel everywhere."""
    law = unequal.law
    on_line = 0
    for phase, te, t1, t2 in zip(
        cycle.phase,
        cycle.transmission_error[0],
        cycle.torque_driver[0],
        cycle.torque_driven[0],
        strict=True,
    ):
        found = held(law, phase, te)
        loaded = found.pairs[found.active]
        assert np.all(loaded["side"] == 0)
        pull = found.force[found.active] @ loaded["ny"]
        assert t1 + t2 == pytest.approx(law.centre * pull, rel=1e-9)
        assert t1 == pytest.approx(TORQUE, rel=1e-9)
        if np.all(loaded["slave"] == ON_LINE):
            on_line += 1
            assert t2 / t1 == pytest.approx(30 / 20, rel=1e-6)
        else:
            assert t2 / t1 != pytest.approx(30 / 20, rel=1e-6)
    assert 20 < on_line < 41


def test_shares_add_up_and_pass_from_tooth_to_tooth(cycle: Any) -> None:
    share = cycle.load_share[0]
    np.testing.assert_allclose(share.sum(axis=1), 1.0, atol=1e-9)
    assert share.shape[1] == 3 or share.shape[1] == 2
    # At the pitch point one pair carries; half a pitch away two do.
    assert share[20].max() == pytest.approx(1.0, abs=1e-12)
    assert np.sort(share[0])[-2] > 0.2
    # One pitch on, the next tooth has taken the place of this one.
    np.testing.assert_allclose(share[0][share[0] > 0], share[-1][share[-1] > 0], rtol=1e-6)


def test_the_cycle_repeats_from_tooth_to_tooth(unequal: Any, cycle: Any) -> None:
    later = static_cycle(unequal.law, cycle.phase + 3.0, torque=[TORQUE])
    np.testing.assert_allclose(later.transmission_error, cycle.transmission_error, rtol=1e-8)


def test_given_dte_and_given_torque_agree(unequal: Any, cycle: Any) -> None:
    at = 7
    back = static_cycle(unequal.law, cycle.phase[[at]], dte=[cycle.transmission_error[0, at]])
    assert back.torque_driver[0, 0] == pytest.approx(TORQUE, rel=1e-9)
    assert back.stiffness_secant[0, 0] == pytest.approx(cycle.stiffness_secant[0, at], rel=1e-9)


def test_tangent_stiffness_is_the_slope_of_force_over_dte(unequal: Any, cycle: Any) -> None:
    for at in range(0, 41, 4):
        te = cycle.transmission_error[0, at]
        step = 1e-4 * te
        t = static_cycle(unequal.law, cycle.phase[[at]], dte=[te - step, te + step]).torque_driver[:, 0]
        slope = (t[1] - t[0]) / (2 * step) / unequal.law.driver.rb
        assert cycle.stiffness_tangent[0, at] == pytest.approx(slope, rel=2e-3)


@pytest.mark.validation
def test_te_does_not_depend_on_the_mesh(gear: Any, twins: Any) -> None:
    half = condense(gear(), twins.rig.material, 0.25e-3, 0)
    fine = make_law(twins.pair, half, half, twins.rig.material)
    # Line of action, both tip edges, and the handovers.
    phases = np.linspace(-0.5, 0.5, 25)
    coarse = static_cycle(twins.law, phases, torque=[TORQUE]).transmission_error
    np.testing.assert_allclose(static_cycle(fine, phases, torque=[TORQUE]).transmission_error, coarse, rtol=5e-4)


def zones(law: Any, phases: NDArray[np.float64]) -> NDArray[np.int64]:
    """Loaded pairs at each phase, less 10 for a pair on a tip edge."""
    out = []
    for phase in phases:
        dte = solve_torque(law, float(phase), TORQUE)
        found = held(law, float(phase), dte)
        slave = found.pairs["slave"][found.active]
        out.append(len(slave) - (10 if np.any(slave != ON_LINE) else 0))
    return np.array(out)


@pytest.mark.parametrize("pairs", [1, 2])
def test_te_does_not_ripple_inside_a_zone(unequal: Any, pairs: int) -> None:
    """400 positions: second differences over the range of TE."""
    law = unequal.law
    phases = np.linspace(-0.5, 0.9, 561)
    inside = np.nonzero(zones(law, phases) == pairs)[0]
    runs = np.split(inside, np.nonzero(np.diff(inside) > 1)[0] + 1)
    longest = max(runs, key=len)
    # A Hertz half-width is 0.01 cycles: closer to its ends the zone belongs to the tip corners.
    low, high = phases[longest[0]] + 0.03, phases[longest[-1]] - 0.03
    assert high - low > 0.2
    te = static_cycle(law, np.linspace(low, high, 400), torque=[TORQUE]).transmission_error[0]
    ripple = np.abs(np.diff(te, 2)).max() / np.ptp(te)
    assert ripple < 1e-3


def test_equal_gears_see_each_other_alike(twins: Any) -> None:
    """Seen from the driven gear, turned backwards, the cycle is its mirror image: the gears change places."""
    law = twins.law
    dte = 1.5e-5
    shift = dte / (law.driver.rb * law.driver.pitch)
    for phase in np.linspace(-0.5, 0.5, 11):
        there, back = held(law, phase, dte), held(law, -phase - shift, dte)
        assert there.torque_driver == pytest.approx(back.torque_driven, rel=1e-9)


def test_back_flanks_mirror_working_flanks(twins: Any) -> None:
    """The whole arrangement reflected in the line of centres: torques change sign, forces stay."""
    law = twins.law
    for phase in (-0.45, 0.0, 0.2, 0.4):
        theta1, theta2 = phase * law.driver.pitch + 2e-5 / law.driver.rb, phase * law.driven.pitch
        front = position(law, theta1, theta2, 0.0, 1e-5, 0.0, -1e-5, FREE)
        mirrored1 = -theta1 - 2 * law.driver.zero
        mirrored2 = -theta2 + 2 * law.driven.zero + law.driven.pitch
        back = position(law, mirrored1, mirrored2, 0.0, -1e-5, 0.0, 1e-5, FREE)
        assert front.torque_driver > 0
        assert np.all(back.pairs["side"][back.active] == 1)
        assert back.torque_driver == pytest.approx(-front.torque_driver, rel=1e-9)
        assert back.torque_driven == pytest.approx(-front.torque_driven, rel=1e-9)
        assert back.tangent == pytest.approx(front.tangent, rel=1e-6)
        np.testing.assert_allclose(np.sort(back.force)[::-1][:2], np.sort(front.force)[::-1][:2], rtol=1e-9)


def test_te_vanishes_with_the_load(unequal: Any) -> None:
    law = unequal.law
    te = static_cycle(law, np.array([0.0, 0.2]), torque=[1e-3, TORQUE]).transmission_error
    assert np.all(te[0] < 1e-3 / TORQUE * te[1] * 2)
    assert np.all(te[0] > 1e-3 / TORQUE * te[1])


@pytest.mark.validation
def test_plane_strain_is_stiffer_as_converged_pairs_are(gear: Any, twins: Any) -> None:
    """Physics 4: 7.5-8.4 %."""
    strain = Material(state="plane-strain")
    wheel = condense(gear(), strain, 0.5e-3, 0)
    law = make_law(twins.pair, wheel, wheel, strain)
    phases = np.array([-0.5, -0.2, 0.0, 0.3])
    dte = [1.5e-5]
    ratio = static_cycle(law, phases, dte=dte).torque_driver / static_cycle(twins.law, phases, dte=dte).torque_driver
    assert np.all(ratio > 1.07)
    assert np.all(ratio < 1.09)


def test_opening_the_centres_needs_rotation(unequal: Any) -> None:
    """A driver centre moved back by y1 along the tangent: its rotation takes back y1 cos(alpha_w)."""
    law = unequal.law
    alpha = unequal.pair.working_pressure_angle
    y = np.array([-2e-5, 0.0])
    still = solve_torque(law, 0.0, TORQUE)
    moved = solve_torque(law, 0.0, TORQUE, 0.0, np.zeros(2), y)
    assert moved - still == pytest.approx(2e-5 * np.cos(alpha), rel=2e-3)


@pytest.mark.parametrize("load", [[0.0], [-1.0], [np.nan], []])
def test_impossible_loads_are_refused(unequal: Any, load: list[float]) -> None:
    if load:
        with pytest.raises(ContactError, match="must be positive and finite"):
            static_cycle(unequal.law, np.zeros(1), torque=load)
    with pytest.raises(ContactError, match="either torques or transmission errors"):
        static_cycle(unequal.law, np.zeros(1), torque=load, dte=load)


def test_progress_is_told(unequal: Any) -> None:
    told: list[float] = []
    static_cycle(unequal.law, np.zeros(3), torque=[10.0, 20.0], progress=told.append)
    np.testing.assert_allclose(told, np.arange(1, 7) / 6)
