"""Static analysis of gears with micro-geometry and errors against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact.law import Law, make_law
from gearbench.fem.contact.static import ContactError, solve_torque, static_cycle, unloaded_dte
from gearbench.rig import Gear

LIGHT = 0.2  # N m: presses the flanks by 0.03 um
PHASES = np.linspace(-0.5, 0.5, 41)


def real(elastic: Any, driver: dict[str, Any] | None = None, driven: dict[str, Any] | None = None) -> Law:
    """The law of a pair of which the gears' fields have been changed; its curves stay."""
    rig = elastic.rig
    gears = tuple(
        Gear(**{**gear.model_dump(), **(changes or {})})
        for gear, changes in ((rig.driver, driver), (rig.driven, driven))
    )
    return make_law(elastic.pair, *elastic.gears, rig.material, curves=elastic.law.curves[:2], gears=gears)


def pitches(teeth: int, **errors: float) -> tuple[float, ...]:
    """Zero but for the named teeth: t3=5e-6."""
    out = [0.0] * teeth
    for name, value in errors.items():
        out[int(name[1:])] = value
    return tuple(out)


def diameter(shape: Any, rho: float) -> float:
    return 2 * float(np.hypot(shape.base_radius, rho))


def test_neutral_values_change_no_bit(unequal: Any) -> None:
    plain = unequal.law
    neutral = real(
        unequal,
        {"pitch_error": (0.0,) * 20, "tip_relief_start_diameter": 63e-3, "tip_relief_shape": "parabolic"},
        {"wear_tooth": (1.0,) * 30, "runout_phase": 0.4, "profile_form": (0.0, 0.0), "profile_form_roll": (0.1, 0.6)},
    )
    one = static_cycle(plain, PHASES, torque=[5.0, 120.0])
    two = static_cycle(neutral, PHASES, torque=[5.0, 120.0])
    for name in ("transmission_error", "torque_driven", "stiffness_tangent", "stiffness_secant", "load_share"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert not one.unloaded.any()


def test_pitch_errors_make_the_manufactured_te(unequal: Any) -> None:
    """Without load the pair with most excess among those on the path of contact touches."""
    law = real(
        unequal, {"pitch_error": pitches(20, t3=8e-6, t4=-5e-6)}, {"pitch_error": pitches(30, t3=-2e-6, t5=4e-6)}
    )
    # Around the pitch point one pair is in contact, half a pitch away two.
    for phase, excess in ((3.0, 6e-6), (4.0, -5e-6), (5.0, 4e-6), (3.5, 6e-6), (4.5, 4e-6), (23.0, 8e-6), (35.0, 4e-6)):
        assert unloaded_dte(law, phase) == pytest.approx(-excess, abs=1e-12), phase
    cycle = static_cycle(law, np.array([3.0, 4.0]), torque=[LIGHT, 100.0])
    sound = static_cycle(unequal.law, np.array([3.0, 4.0]), torque=[LIGHT, 100.0])
    np.testing.assert_allclose(cycle.unloaded, [-6e-6, 5e-6], atol=1e-12)
    # One pair alone: the load adds what it adds to sound gears.
    expected = sound.transmission_error + cycle.unloaded
    np.testing.assert_allclose(cycle.transmission_error, expected, atol=2e-9)
    np.testing.assert_allclose(cycle.stiffness_secant, sound.stiffness_secant, rtol=1e-3)


def test_a_pair_that_lacks_material_carries_less(twins: Any) -> None:
    """In double contact: F = k1 (d + a1) + k2 (d + a2), so a shortfall beyond the deflection takes all of the load."""
    law = real(twins, {"pitch_error": pitches(20, t1=-100e-6)})
    share = static_cycle(law, np.array([0.5]), torque=[50.0]).load_share[0, 0]
    assert np.sort(share)[-1] == pytest.approx(1.0, abs=1e-12)
    small = real(twins, {"pitch_error": pitches(20, t1=-1e-6)})
    lacking = static_cycle(small, np.array([0.5]), torque=[50.0]).load_share[0, 0]
    sound = static_cycle(twins.law, np.array([0.5]), torque=[50.0]).load_share[0, 0]
    assert lacking.max() > sound.max() + 0.02


def test_runout_gives_half_of_f_r_at_shaft_order_with_its_phase(unequal: Any) -> None:
    runout, angle = 40e-6, 0.9
    law = real(unequal, {"runout": runout, "runout_phase": angle})
    phases = np.arange(20) + 0.02
    te = np.array([unloaded_dte(law, float(p)) for p in phases])
    turn = 2 * np.pi * phases / 20
    wave = 2 * np.mean(te * np.exp(-1j * turn))
    # Excess adds most at its phase, where the driver stays behind.
    assert abs(wave) == pytest.approx(runout / 2, rel=1e-3)
    assert np.angle(-wave) == pytest.approx(-angle, abs=1e-3)
    law = real(unequal, None, {"runout": runout, "runout_phase": angle})
    phases = np.arange(30) + 0.02
    te = np.array([unloaded_dte(law, float(p)) for p in phases])
    wave = 2 * np.mean(te * np.exp(-2j * np.pi * phases / 30))
    assert abs(wave) == pytest.approx(runout / 2, rel=1e-3)
    assert np.angle(-wave) == pytest.approx(-angle, abs=1e-3)


def two_pairs(law: Law, torque: float) -> float:
    """Part of the mesh cycle in which two pairs carry load."""
    phases = (np.arange(200) + 0.5) / 200
    share = static_cycle(law, phases, torque=[torque]).load_share[0]
    return float(np.mean((share > 1e-9).sum(axis=1) == 2))


def test_short_relief_shortens_contact_at_light_load(unequal: Any) -> None:
    """Contact ratio between the starts of relief: (rho1 + rho2 - line of action)/base pitch; under load it grows."""
    pair = unequal.pair
    starts = (pair.driver.rho_end - 1.2e-3, pair.driven.rho_end - 1.5e-3)
    fields = [
        {"tip_relief": 30e-6, "tip_relief_start_diameter": diameter(shape, rho)}
        for shape, rho in zip((pair.driver, pair.driven), starts, strict=True)
    ]
    law = real(unequal, *fields)
    ratio = (sum(starts) - pair.line_of_action) / pair.base_pitch
    assert 1.2 < ratio < 1.5
    assert two_pairs(unequal.law, LIGHT) == pytest.approx(pair.contact_ratio - 1, abs=0.02)
    assert two_pairs(law, LIGHT) == pytest.approx(ratio - 1, abs=0.03)
    assert two_pairs(law, 400.0) > ratio - 1 + 0.1
    assert unloaded_dte(law, 0.5) == pytest.approx(0.0, abs=1e-12)


def test_long_relief_is_the_te_without_load(unequal: Any) -> None:
    """Relief from the pitch point on leaves a gap: the envelope of a straight line, a + R (da/ds)^2/2."""
    pair = unequal.pair
    amount = 20e-6
    shape, start = pair.driver, pair.rho_pitch[0]
    law = real(unequal, {"tip_relief": amount, "tip_relief_start_diameter": diameter(shape, start)})
    slope = amount / (shape.rho_end - start)
    for phase in (0.08, 0.14):
        rho = start + phase * pair.base_pitch
        curvature = rho * (pair.line_of_action - rho) / pair.line_of_action
        excess = -slope * (rho - start) + curvature * (slope * shape.base_radius / rho) ** 2 / 2
        # Driver's roll: its relief lets it turn ahead by as much.
        assert unloaded_dte(law, phase) == pytest.approx(-excess, rel=0.02)
        assert unloaded_dte(law, phase) != pytest.approx(slope * phase * pair.base_pitch, rel=0.02)


def test_long_relief_has_a_design_load(twins: Any) -> None:
    """Linear relief from the highest point of single contact on: with two pairs d = F/2k + C/2, with one d = F/k, so TE
    is flattest where one pair's deflection is the relief C (Munro 1989)."""
    pair, amount = twins.pair, 14e-6
    highest = pair.active_driver[0] + pair.base_pitch
    field = {"tip_relief": amount, "tip_relief_start_diameter": diameter(pair.driver, highest)}
    law = real(twins, field, field)
    loads = np.linspace(60.0, 500.0, 23)
    cycle = static_cycle(law, PHASES, torque=loads.tolist())
    swing = np.ptp(cycle.transmission_error, axis=1)
    best = int(np.argmin(swing))
    assert 0 < best < len(loads) - 1
    single = cycle.transmission_error[best, len(PHASES) // 2]
    assert single == pytest.approx(amount, rel=0.25)
    plain = static_cycle(twins.law, PHASES, torque=[loads[best]]).transmission_error
    assert swing[best] < 0.4 * np.ptp(plain)
    assert swing[best] < 0.4 * np.ptp(cycle.unloaded)


def test_tangent_is_the_slope_of_the_torque(unequal: Any) -> None:
    law = real(
        unequal,
        {"tip_relief": 20e-6, "tip_relief_start_diameter": 62.5e-3, "runout": 30e-6, "runout_phase": np.pi},
        {"pitch_error": pitches(30, t1=3e-6), "tip_relief": 20e-6, "tip_relief_start_diameter": 92.5e-3},
    )
    for phase in (-0.45, -0.2, 0.0, 0.3, 0.45):
        te = solve_torque(law, phase, 120.0)
        step = 1e-4 * abs(te)
        t = static_cycle(law, np.array([phase]), dte=[te - step, te + step]).torque_driver[:, 0]
        cycle = static_cycle(law, np.array([phase]), torque=[120.0])
        assert cycle.torque_driver[0, 0] == pytest.approx(120.0, rel=1e-9)
        slope = (t[1] - t[0]) / (2 * step) / law.driver.rb
        assert cycle.stiffness_tangent[0, 0] == pytest.approx(slope, rel=3e-3)


def test_wear_of_all_teeth_is_taken_up_by_rotation(unequal: Any) -> None:
    law = real(unequal, {"wear": 7e-6}, {"wear": 2e-6})
    cycle = static_cycle(law, PHASES, torque=[100.0])
    sound = static_cycle(unequal.law, PHASES, torque=[100.0])
    np.testing.assert_allclose(cycle.unloaded, 9e-6, atol=1e-12)
    # Tip edges have moved along the normal of the flank, which is not theirs.
    np.testing.assert_allclose(cycle.transmission_error - 9e-6, sound.transmission_error, atol=1.5e-7)


def test_a_given_dte_that_closes_nothing_has_no_stiffness(unequal: Any) -> None:
    cycle = static_cycle(real(unequal, {"wear": 50e-6}), np.zeros(1), dte=[10e-6, 60e-6])
    assert cycle.torque_driver[0, 0] == 0.0 and cycle.stiffness_secant[0, 0] == 0.0
    assert cycle.stiffness_secant[1, 0] == pytest.approx(cycle.torque_driver[1, 0] / unequal.law.driver.rb / 10e-6)


@pytest.mark.parametrize("dte", [4e-4, 1e-3])
def test_contact_that_leaves_the_flanks_is_refused(unequal: Any, dte: float) -> None:
    sentence = rf"^dte_um = {1e6 * dte:g} takes contact off the modelled flanks at mesh phase .* um: lower it"
    with pytest.raises(ContactError, match=sentence + "$"):
        static_cycle(unequal.law, np.linspace(0, 0.9, 10), dte=[dte])
    with pytest.raises(ContactError, match=sentence + r", or the errors that move the flanks by up to 5 um$"):
        static_cycle(real(unequal, {"wear": 5e-6}), np.linspace(0, 0.9, 10), dte=[dte])
