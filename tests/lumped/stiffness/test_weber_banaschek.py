"""Weber and Banaschek's deflections: closed forms, integrals of the half-plane, the published constants."""

from __future__ import annotations

from math import cos, pi, sqrt, tan
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from gearbench.geometry import pair, profile
from gearbench.lumped.errors import LumpedError
from gearbench.lumped.stiffness.weber_banaschek import (
    Constants,
    beam,
    constants,
    flattening,
    foundation,
    mesh_deflection,
    pair_deflection,
    pair_stiffness,
    tooth_deflection,
)
from gearbench.rig import Gear, Material, Rig, Support, Supports

STEEL = Constants(206e9, 0.3)


def make_rig(driver: dict[str, Any], driven: dict[str, Any], **material: Any) -> Rig:
    def gear(changes: dict[str, Any]) -> Gear:
        filled = {"module": 3e-3, "face_width": 0.02, "tip_edge_radius": 0.0, **changes}
        return Gear(hub_radius=1e-3 * changes["teeth"], **filled)

    support = Support(stiffness=1e8)
    return Rig(
        driver=gear(driver),
        driven=gear(driven),
        material=Material(**material),
        support=Supports(driver=support, driven=support),
    )


RIG = make_rig({"teeth": 25, "profile_shift": 0.2}, {"teeth": 40}, state="plane-strain")


@pytest.mark.parametrize("alpha", [0.0, 0.35])
def test_rectangular_tooth_is_a_cantilever_of_a_wide_plate(alpha: float) -> None:
    """Tip force through the axis: F cos(a) bends and shears a plate (E/(1 - nu^2)), F sin(a) presses it."""
    length, half, width = 5e-3, 1e-3, 0.02
    x, w = np.polynomial.legendre.leggauss(8)
    heights, weights = 0.5 * length * (x + 1)[None, :], 0.5 * length * w[None, :]
    found = beam(
        np.array([length]), heights, np.full((1, 8), half), weights, np.array([alpha]), elastic=STEEL, width=width
    )
    plate, shear = 206e9 / (1 - 0.09), 206e9 / 2.6
    area, second = 2 * half * width, width * (2 * half) ** 3 / 12
    bent = cos(alpha) ** 2 * length**3 / (3 * plate * second)
    sheared = 1.2 * cos(alpha) ** 2 * length / (shear * area)
    pressed = (cos(alpha) * tan(alpha)) ** 2 * length / (plate * area)
    assert found[0] == pytest.approx(bent + sheared + pressed, rel=1e-12)


def test_foundation_has_the_published_constants() -> None:
    """5.2 (u/s)^2 + u/s + 1.4 (1 + 0.294 tan^2 a), over E b, for nu = 0.3."""
    reach, chord, alpha = np.array([2e-3, 5e-3]), 6e-3, np.array([0.2, 0.4])
    found = foundation(reach, chord, alpha, elastic=STEEL, width=0.02) * 206e9 * 0.02
    lever = reach / chord
    published = np.cos(alpha) ** 2 * (5.2 * lever**2 + lever + 1.4 * (1 + 0.294 * np.tan(alpha) ** 2))
    np.testing.assert_allclose(found, published, rtol=0.02)


def test_flattening_is_the_compression_below_a_hertz_pressure() -> None:
    """Strain below the middle of a semi-elliptic pressure (Johnson 1985, eq. 4.46), integrated over depth."""
    force, width, w, depth = 800.0, 0.02, 60e-6, 1.5e-3
    peak = 2 * force / (pi * w * width)

    def strain(z: float) -> float:
        root = sqrt(w * w + z * z)
        along = -peak / w * ((w * w + 2 * z * z) / root - 2 * z)
        across = -peak * w / root
        return -(across * (1 - 0.09) - 0.3 * 1.3 * along) / 206e9

    compressed = quad(strain, 0.0, 5 * w)[0] + quad(strain, 5 * w, depth)[0]
    found = force * flattening(np.array([depth]), np.array([w]), STEEL, width)[0]
    # The formula leaves out terms of (w/h)^2.
    assert found == pytest.approx(compressed, rel=2 * (w / depth) ** 2)


def test_sections_reach_from_the_root_to_the_axis_crossing() -> None:
    """Tooth part against the same integrals by trapezoids over the outline."""
    tooth = profile(RIG.driver)
    rho = np.array([0.6 * tooth.rho_form + 0.4 * tooth.rho_end, 0.98 * tooth.rho_end])
    found = tooth_deflection(tooth, RIG.material, 0.02, rho)
    outline = np.concatenate(
        [
            tooth.fillet(np.linspace(0, tooth.beta_form, 200001)),
            tooth.involute(np.linspace(tooth.rho_form, tooth.rho_end, 20001)),
        ]
    )
    for k, roll in enumerate(rho):
        point, normal = tooth.involute(roll), tooth.involute_normals(roll)
        crossing = point[0] - point[1] * normal[0] / normal[1]
        below = outline[outline[:, 0] <= crossing]
        thick = 2 * below[:, 1]
        second = np.trapezoid((crossing - below[:, 0]) ** 2 / thick**3, below[:, 0])
        first = np.trapezoid(1 / thick, below[:, 0])
        slope = -normal[0] / normal[1]
        wanted = (12 * second + (2.4 / 0.7 + slope**2) * first) * 0.91 / 206e9 / 0.02 / (1 + slope**2)
        assert found.tooth[k] == pytest.approx(wanted, rel=2e-4)
        assert found.depth[k] == pytest.approx(np.hypot(*(point - [crossing, 0.0])), rel=1e-12)
        chord = 2 * outline[0, 1]
        base = foundation(np.array([crossing - outline[0, 0]]), chord, np.arctan([slope]), elastic=STEEL, width=0.02)
        assert found.foundation[k] == pytest.approx(base[0], rel=1e-9)


def test_plane_stress_is_the_thin_plate() -> None:
    """E and shear modulus of a free plate: bending by E, shear by the same G, compression by E."""
    thin = constants(Material(state="plane-stress"))
    assert thin.compliance == pytest.approx(1 / 206e9, rel=1e-12)
    assert thin.youngs / (2 * (1 + thin.poisson)) == pytest.approx(206e9 / 2.6, rel=1e-12)
    assert constants(Material(state="plane-strain")) == Constants(206e9, 0.3)


def test_pair_adds_both_teeth_and_the_contact() -> None:
    meshing = pair(RIG)
    rho, force = meshing.rho_pitch[0], 2e3
    mate = meshing.line_of_action - rho
    width = meshing.face_width
    one = tooth_deflection(meshing.driver, RIG.material, width, rho)
    two = tooth_deflection(meshing.driven, RIG.material, width, mate)
    radius = 1 / (1 / rho + 1 / mate)
    half_width = sqrt(4 * force * radius / (pi * width * 206e9 / (2 * 0.91)))  # Johnson 1985, eq. 4.43
    contact = sum(flattening(t.depth, np.array([half_width]), STEEL, width)[0] for t in (one, two))
    linear = sum((t.tooth + t.foundation)[0] for t in (one, two))
    found = pair_deflection(RIG, meshing, rho, force)[0]
    assert found == pytest.approx(force * (linear + contact), rel=1e-12)
    assert pair_stiffness(RIG, meshing, rho, force)[0] == pytest.approx(force / found)
    assert pair_deflection(RIG, meshing, rho, 0.0)[0] == 0.0
    # Harder under load, since contact grows less than in proportion.
    assert pair_stiffness(RIG, meshing, rho, 10 * force)[0] > pair_stiffness(RIG, meshing, rho, force)[0]


def test_mesh_shares_the_force_at_equal_deflection() -> None:
    meshing = pair(RIG)
    force = 3e3
    start, stop = ((rho - meshing.rho_pitch[0]) / meshing.base_pitch for rho in meshing.active_driver)
    for phase in (start + 0.1, 0.5 * (start + stop), stop - 0.01):
        deflection = mesh_deflection(RIG, meshing, phase + 3, force)[0]
        own = phase + np.arange(-2, 3)
        rho = meshing.rho_pitch[0] + meshing.base_pitch * own[(own >= start) & (own <= stop)]
        trial = np.linspace(0.0, force, 20001)
        carried = sum(np.interp(deflection, pair_deflection(RIG, meshing, r, trial), trial) for r in rho)
        assert carried == pytest.approx(force, rel=1e-6)


def test_many_phases_are_interpolated() -> None:
    meshing = pair(RIG)
    phase = np.linspace(0.0, 1.0, 3001)
    few = mesh_deflection(RIG, meshing, phase[::100], 3e3)
    np.testing.assert_allclose(mesh_deflection(RIG, meshing, phase, 3e3)[::100], few, rtol=1e-6)


def test_bad_forces_are_refused() -> None:
    meshing = pair(RIG)
    with pytest.raises(LumpedError, match="at least 0 N"):
        pair_deflection(RIG, meshing, meshing.rho_pitch[0], -1.0)
    with pytest.raises(LumpedError, match="greater than 0 N for a"):
        pair_stiffness(RIG, meshing, meshing.rho_pitch[0], 0.0)
    with pytest.raises(LumpedError, match="greater than 0 N"):
        mesh_deflection(RIG, meshing, 0.0, 0.0)
