"""Tables of the truth rig's tooth pairs against geometry and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from shared.truth_plants import short_bench

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.teeth import (
    NODES,
    PairLaw,
    corner_clearance,
    corner_gap,
    mean_tangent,
    pair_law,
    path_ends,
    scaled,
)
from gearbench.geometry import pair
from gearbench.rig import Case

MESHING = short_bench().meshing
RIG = short_bench().nominal.rig


def test_path_is_as_long_as_the_contact_ratio() -> None:
    low, high = path_ends(MESHING)
    assert low < 0 < high
    assert high - low == pytest.approx(MESHING.contact_ratio, rel=1e-12)


@pytest.mark.parametrize("side", ["entry", "exit"])
def test_corner_clearance_is_the_distance_to_the_turned_flank(side: str) -> None:
    """Brute force: both gears as points, turned back about their centres, nearest point of the flank."""
    one, two = (MESHING.driver, MESHING.driven) if side == "entry" else (MESHING.driven, MESHING.driver)
    rho = MESHING.line_of_action - two.rho_end
    distance = 0.4e-3
    # Flank of one in its frame, turned so that it touches at `rho` on the line of action, then back.
    flank = one.involute(np.linspace(one.rho_form, one.rho_end, 200_001))
    alpha = MESHING.working_pressure_angle
    turn = -alpha + rho / one.base_radius - one.psi_b - distance / one.base_radius
    c, s = np.cos(turn), np.sin(turn)
    flank = flank @ np.array([[c, s], [-s, c]])
    # The corner lies on the line of action at the end of the path; turned back about its own centre.
    line = np.array([np.sin(alpha), np.cos(alpha)])
    touch = one.base_radius * np.array([np.cos(alpha), -np.sin(alpha)]) + rho * line
    centre = np.array([MESHING.centre_distance, 0.0])
    assert np.hypot(*(touch - centre)) == pytest.approx(two.end_radius, rel=1e-12)
    back = distance / two.base_radius
    corner = centre + np.array([[np.cos(back), -np.sin(back)], [np.sin(back), np.cos(back)]]) @ (touch - centre)
    nearest = np.hypot(*(flank - corner).T).min()
    found = float(corner_clearance(MESHING, one, two, rho, np.array([distance]))[0])
    assert found == pytest.approx(nearest, rel=2e-3)
    assert found > 4e-6


def test_gap_grows_as_the_square_beyond_the_ends() -> None:
    law = pair_law(RIG, MESHING, "parabola", 0.3)
    low, high = law.inside
    for coefficient, beyond in zip(corner_gap(MESHING), (low - law.place, law.place - high), strict=True):
        outside = beyond > 0
        expected = coefficient * (beyond[outside] * MESHING.base_pitch) ** 2
        assert law.gap[outside] == pytest.approx(expected, rel=1e-9, abs=1e-15)
    assert (law.gap[(law.place > low) & (law.place < high)] == 0).all()


def test_a_pair_is_followed_until_it_lets_go() -> None:
    """Both ends of the table stand farther apart than a pair is pressed in, so that no contact ends at a blow."""
    short, long = pair_law(RIG, MESHING, "energy", 0.0), pair_law(RIG, MESHING, "energy", 0.0, 90e-6)
    assert short.gap[[0, -1]].min() < 90e-6 <= long.gap[[0, -1]].min() * (1 + 1e-9)
    assert pair_law(RIG, MESHING, "energy", 0.0, 0.5 * short.gap[[0, -1]].min()).first == short.first


@pytest.mark.parametrize("shape", ["parabola", "cosine"])
def test_shapes_lose_the_bow_at_both_ends(shape: str) -> None:
    law = pair_law(RIG, MESHING, shape, 0.3)  # type: ignore[arg-type]
    assert law.stiffness.max() == pytest.approx(1.0, abs=1e-5)
    assert law.stiffness[[0, -1]] == pytest.approx([0.7, 0.7], rel=1e-12)


def test_shares_of_the_energy_law_leave_the_contact_part() -> None:
    law = pair_law(RIG, MESHING, "energy", 0.0)
    width, material = MESHING.face_width, RIG.material
    hertz = 4 * (1 - material.poisson**2) / (np.pi * material.youngs_modulus * width)
    assert 1 - law.share_driver - law.share_driven == pytest.approx(hertz * law.stiffness, rel=1e-9)


def even_law(stiffness: float, span: float) -> PairLaw:
    """Constant stiffness over `span` base pitches, no gap."""
    table = np.full(NODES, stiffness)
    share = np.zeros(NODES)
    return PairLaw(-0.5 * span, span / (NODES - 1), table, share, share, np.zeros(NODES), (-0.5 * span, 0.5 * span))


def test_mean_tangent_counts_the_pairs() -> None:
    # A contact ratio of 1.6: two pairs for 0.6 of the cycle, one for 0.4.
    assert mean_tangent(even_law(1e8, 1.6), 0.0, 1e-5, 3000.0) == pytest.approx(1.6e8, rel=1e-2)
    # One pair: F = k d (d/d0)^p, so the tangent is (1 + p) k (F/(k d0))^(p/(1 + p)).
    p, k, force = 0.1, 1e8, 3000.0
    expected = (1 + p) * k * (force / (k * 1e-5)) ** (p / (1 + p))
    assert mean_tangent(even_law(k, 1.004), p, 1e-5, force) == pytest.approx(expected, rel=1e-2)


@pytest.mark.parametrize("shape", ["parabola", "cosine", "energy"])
def test_scale_is_met(shape: str) -> None:
    law = scaled(pair_law(RIG, MESHING, shape, 0.2), 0.08, 1e-5, 3500.0, 4.2e8)  # type: ignore[arg-type]
    assert mean_tangent(law, 0.08, 1e-5, 3500.0) == pytest.approx(4.2e8, rel=1e-8)


def test_a_load_beyond_reach_is_refused() -> None:
    with pytest.raises(ChallengeError, match="no tooth pair carries"):
        mean_tangent(even_law(1e3, 1.2), 0.0, 1e-5, 3000.0)


def test_other_gears_have_other_corners() -> None:
    case: Case = short_bench().nominal
    shifted = case.rig.model_copy(update={"driven": case.rig.driven.model_copy(update={"teeth": 60})})
    start, end = corner_gap(pair(shifted))
    assert 0 < end < start
