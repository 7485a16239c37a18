"""Potential energy method against beams in closed form and a published programme."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.geometry import inverse_involute, pair, profile
from gearbench.lumped.stiffness.potential_energy import (
    Sections,
    beam_compliance,
    foundation_polynomials,
    hertz_compliance,
    outside_foundation_fit,
    pair_stiffness,
    tooth_compliance,
    tooth_sections,
)
from gearbench.rig import Gear, Material, Rig, Support, Supports

ROSS = {"teeth": 62, "module": 2e-3, "face_width": 0.02, "hub_radius": 0.0175, "bore_radius": 0.0175}


def make_rig(driver: dict[str, Any], driven: dict[str, Any] | None = None, **material: Any) -> Rig:
    support = Support(stiffness=1e8)
    return Rig(
        driver=Gear(**{"tip_edge_radius": 0.0, **driver}),
        driven=Gear(**{"tip_edge_radius": 0.0, **(driven or driver)}),
        material=Material(**material),
        support=Supports(driver=support, driven=support),
    )


def rectangle(length: float, half: float) -> Sections:
    nodes, weights = np.polynomial.legendre.leggauss(8)
    x = 0.5 * length * (nodes + 1)
    return Sections(x[None, :], np.full((1, 8), half), 0.5 * length * weights[None, :])


@pytest.mark.parametrize("angle", [0.0, 0.3, -0.2])
def test_rectangular_tooth_is_the_textbook_cantilever(angle: float) -> None:
    length, half, width, youngs, shear = 5e-3, 1e-3, 0.02, 2e11, 8e10
    bending, shearing, pressing = beam_compliance(
        rectangle(length, half),
        np.array([[length, half]]),
        np.array([angle]),
        youngs=youngs,
        shear=shear,
        width=width,
    )
    area, second = 2 * half * width, width * (2 * half) ** 3 / 12
    lateral, axial = np.cos(angle), np.sin(angle)
    # Tip force with lateral part P and end moment -N h: superposed beam formulas, deflection along the force.
    textbook = (
        lateral**2 * length**3 / 3 - lateral * axial * half * length**2 + (axial * half) ** 2 * length
    ) / (youngs * second)
    np.testing.assert_allclose(bending, textbook, rtol=1e-12)
    np.testing.assert_allclose(shearing, 1.2 * lateral**2 * length / (shear * area), rtol=1e-12)
    np.testing.assert_allclose(pressing, axial**2 * length / (youngs * area), rtol=1e-12, atol=0)


def test_sections_fill_the_tooth_between_root_and_contact() -> None:
    tooth = profile(Gear(**ROSS))
    rho = np.linspace(1.05 * tooth.rho_form, tooth.rho_end, 5)
    sections = tooth_sections(tooth, rho)
    area = (2 * sections.half * sections.weight).sum(axis=1)
    for contact, found in zip(rho, area, strict=True):
        outline = np.concatenate(
            [
                tooth.fillet(np.linspace(0.0, tooth.beta_form, 4001)),
                tooth.involute(np.linspace(tooth.rho_form, contact, 4001)),
            ]
        )
        assert found == pytest.approx(np.trapezoid(2 * outline[:, 1], outline[:, 0]), rel=1e-6)
        assert sections.x.min() >= tooth.root_radius * np.cos(np.pi / tooth.teeth)


def test_foundation_is_held_at_the_limits_of_its_fit_and_says_so() -> None:
    assert foundation_polynomials(1.1, 0.2) == foundation_polynomials(1.4, 0.12)
    rig = make_rig({**ROSS, "teeth": 20, "hub_radius": 0.014, "bore_radius": 0.0})
    notes = outside_foundation_fit(rig, pair(rig))
    assert len(notes) == 4
    assert all(note.startswith(("driver: ", "driven: ")) for note in notes)
    assert outside_foundation_fit(make_rig(ROSS), pair(make_rig(ROSS))) == []


def test_reproduces_the_published_programme_under_its_own_simplifications() -> None:
    """ROSS (`Mesh`, documented example) gives 429787128 N/m as its largest stiffness.

    Its contact runs from the rack's own form circle, in equal steps of pressure angle instead of roll
    length, and its foundation takes lever and root angle in a simpler way; beam and Hertz parts must
    agree to all digits.
    """
    youngs, shear, width, hub, alpha, m = 211e9, 81.2e9, 0.02, 0.0175, 0.349066, 2e-3
    rounding = 0.25 / (1 - np.sin(alpha))
    material = Material(youngs_modulus=youngs, poisson=youngs / (2 * shear) - 1)
    tooth = profile(Gear(**ROSS, tip_edge_radius=0.0, rack_tip_radius=rounding))
    rb, rf = tooth.base_radius, tooth.root_radius
    corner = np.hypot(rb * np.tan(alpha) - m / np.sin(alpha), rb)
    start, stop = np.arccos(rb / corner), np.arccos(rb / tooth.tip_radius)
    theta = (np.pi / 2 + 2 * np.tan(alpha) * (1 - rounding) + 2 * rounding / np.cos(alpha)) / 62
    el, em, pe, qu = foundation_polynomials(rf / hub, theta)

    def tooth_at(pressure: np.ndarray) -> np.ndarray:
        rho = rb * np.tan(pressure)
        own = tooth_compliance(tooth, hub, width, material, rho)
        beta = rho / rb - tooth.psi_b
        lever = (tooth.involute(rho)[:, 0] - rf) / (2 * rf * theta)
        shape = el * lever**2 + em * lever + pe * (1 + qu * np.tan(beta) ** 2)
        return own.bending + own.shear + own.axial + np.cos(beta) ** 2 / (youngs * width) * shape

    def pair_at(turn: np.ndarray) -> np.ndarray:
        return 1 / (tooth_at(start + turn) + tooth_at(stop - turn) + hertz_compliance(material, width))

    rig = make_rig(ROSS)
    ratio = pair(rig).contact_ratio
    cycle = (stop - start) / ratio
    turn = np.linspace(0.0, cycle, 1000)
    both = turn <= cycle * (ratio - 1)
    largest = (pair_at(turn[both]) + pair_at(turn[both] + cycle)).max()
    assert largest == pytest.approx(429787128.434, rel=1e-4)


def test_documented_pair_over_the_true_path_of_contact() -> None:
    # The same example with E = 206 GPa over the true path of contact: single pair 2.39e8 at the pitch point.
    rig = make_rig(ROSS)
    meshing = pair(rig)
    single = pair_stiffness(rig, meshing, meshing.rho_pitch[0])[0]
    assert 2.29e8 < single < 2.45e8


def test_exchanging_the_gears_mirrors_the_stiffness() -> None:
    small, large = {**ROSS, "teeth": 25, "hub_radius": 0.012, "bore_radius": 0.0}, ROSS
    rig, mirrored = make_rig(small, large), make_rig(large, small)
    meshing = pair(rig)
    rho = np.linspace(*meshing.active_driver, 7)
    np.testing.assert_allclose(
        pair_stiffness(rig, meshing, rho),
        pair_stiffness(mirrored, pair(mirrored), meshing.line_of_action - rho),
        rtol=1e-12,
    )


def test_stiffness_grows_with_width_modulus_and_plane_strain() -> None:
    rig = make_rig(ROSS)
    meshing = pair(rig)
    rho = np.linspace(*meshing.active_driver, 5)
    reference = pair_stiffness(rig, meshing, rho)
    wide = make_rig({**ROSS, "face_width": 0.04})
    np.testing.assert_allclose(pair_stiffness(wide, pair(wide), rho), 2 * reference, rtol=1e-12)
    hard = make_rig(ROSS, youngs_modulus=412e9)
    np.testing.assert_allclose(pair_stiffness(hard, meshing, rho), 2 * reference, rtol=1e-12)
    strained = pair_stiffness(make_rig(ROSS, state="plane-strain"), meshing, rho)
    assert np.all((strained > reference) & (strained < reference / (1 - 0.3**2)))


def test_hertz_compliance_of_steel() -> None:
    # 4 x 0.91 / (pi 206e9 0.02) by hand.
    assert hertz_compliance(Material(), 0.02) == pytest.approx(2.8122495e-10, rel=1e-7)


def test_inverse_involute_agrees_with_the_direction_of_the_force() -> None:
    # The force makes the angle alpha_t - half_angle(r) with the lateral direction: a second way to its
    # direction.
    tooth = profile(Gear(**ROSS))
    rho = 0.9 * tooth.rho_end
    radius = float(np.hypot(tooth.base_radius, rho))
    pressure = inverse_involute(tooth.psi_b - float(tooth.half_angle(radius)))
    assert rho / tooth.base_radius - tooth.psi_b == pytest.approx(
        pressure - float(tooth.half_angle(radius)), rel=1e-12
    )
