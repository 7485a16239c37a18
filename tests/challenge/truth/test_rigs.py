"""From levels to the plant: phases, signs and sizes of the effects as the contracts count them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.truth_plants import drawn_levels, short_bench, undamped

from gearbench.challenge.truth.levels import Levels
from gearbench.challenge.truth.motion import derivative
from gearbench.challenge.truth.plant import DEGREES, DRIVEN, DRIVER, ROTOR, STATES, Plant, Teeth
from gearbench.challenge.truth.rigs import build_plant, conditions_of
from gearbench.challenge.truth.structure import draw_structure
from gearbench.challenge.truth.teeth import path_ends

BENCH = short_bench()
EXPERIMENT = conditions_of(BENCH.nominal)[0].experiment
RIG = draw_structure(BENCH.nominal, "test", np.random.default_rng(2))
LEVELS = drawn_levels(2)
PATH = path_ends(BENCH.meshing)


def plant_of(levels: Levels) -> Plant:
    return build_plant(BENCH, RIG, levels, EXPERIMENT)


@pytest.mark.parametrize("side", [0, 1])
def test_run_out_adds_half_its_size_at_its_phase(side: int) -> None:
    runout, phase = [0.0, 0.0], [0.0, 0.0]
    runout[side], phase[side] = 12e-6, 0.7
    plant = undamped(plant_of(replace(LEVELS, runout=(runout[0], runout[1]), runout_phase=(phase[0], phase[1]))))
    for turned in (0.7, 1.9, 0.7 + np.pi):
        state = np.zeros(STATES)
        other = plant.base_driver / plant.base_driven
        state[DRIVER], state[DRIVEN] = (turned, turned * other) if side == 0 else (turned / other, turned)
        dte = derivative(plant, 0.0, 0.0, state)[1].dte
        # Second order: the square of the eccentricity over the length of the line of action.
        assert dte == pytest.approx(6e-6 * np.cos(turned - 0.7), abs=(6e-6) ** 2 / 0.01)


def test_ripple_is_a_part_of_the_mean_torque_at_its_orders() -> None:
    size, phase = np.array([0.0, 0.01, 0.0, 0.004]), np.array([0.0, 0.5, 0.0, 2.0])
    plant = plant_of(replace(LEVELS, ripple=size, ripple_phase=phase))
    state = np.zeros(STATES)
    state[ROTOR] = 0.23
    with_it = derivative(plant, 0.0, 0.0, state)[0][DEGREES + ROTOR]
    without = derivative(plant._replace(ripple=0.0 * plant.ripple), 0.0, 0.0, state)[0][DEGREES + ROTOR]
    torque = 100.0 * (0.01 * np.cos(12 * 0.23 + 0.5) + 0.004 * np.cos(24 * 0.23 + 2.0))
    assert (with_it - without) * plant.inertia.rotor == pytest.approx(torque, rel=1e-9)


def test_coupling_resonates_at_its_frequency() -> None:
    plant = plant_of(replace(LEVELS, coupling_frequency=1300.0))
    rotor, driver = plant.inertia.rotor, plant.inertia.driver
    omega = np.sqrt(plant.coupling.stiffness * (1 / rotor + 1 / driver))
    assert omega == pytest.approx(2 * np.pi * 1300.0)


def test_bearing_has_its_stiffness_at_about_the_mean_deflection() -> None:
    plant = plant_of(replace(LEVELS, exponent=(0.5, 0.0)))
    assert plant.support_exponent.tolist() == [0.0, 0.5, 0.0, 0.0]
    force = 100.0 / plant.base_driver * plant.cosine
    assert plant.support_reference[1] == pytest.approx(force / RIG.support[1])


def test_backlash_grows_by_the_transverse_arc_along_the_line_of_action() -> None:
    plant, more = (plant_of(replace(LEVELS, backlash_more=b)) for b in (0.0, 50e-6))
    assert plant.teeth.backlash == pytest.approx(BENCH.meshing.backlash_normal)
    assert more.teeth.backlash - plant.teeth.backlash == pytest.approx(50e-6 * np.cos(np.deg2rad(20)))


def test_crack_takes_its_part_of_the_bending_stiffness() -> None:
    loss = np.zeros(20)
    loss[4] = 0.35
    teeth = plant_of(replace(LEVELS, crack=(loss, np.zeros(30)))).teeth
    # Compliance of the cracked tooth over that of the sound one.
    assert 1 + teeth.crack_driver[4] == pytest.approx(1 / 0.65)
    assert np.count_nonzero(teeth.crack_driver) == 1 and not teeth.crack_driven.any()


def test_tone_lies_off_the_lines() -> None:
    foreign = replace(LEVELS.foreign, tone=0.02, tone_frequency=500.0, tone_offset=0.4)
    tone = plant_of(replace(LEVELS, foreign=foreign)).tone
    spacing = EXPERIMENT.sampling_rate / EXPERIMENT.samples_per_period
    line = tone.frequency / (2 * np.pi * spacing)
    assert tone.amplitude == pytest.approx(2.0)
    assert line - np.floor(line) == pytest.approx(0.4)
    assert abs(line * spacing - 500.0) < spacing


def test_a_bent_law_keeps_force_and_deflection_under_the_mean_torque() -> None:
    """F (F/F0)^p of the force F of the same teeth without it: as large at F0, and stiffer there by 1 + p."""
    plain, bent = (plant_of(replace(LEVELS, contact=contact)).teeth for contact in (0.0, 0.6))
    load = 100.0 / BENCH.meshing.driver.base_radius
    low, high = 0.0, 1e-3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if mean_force(plain, middle) > load else (middle, high)
    # Two pairs and one in turn share the load: single pairs are pressed a little more or less than the mean mesh.
    assert mean_force(bent, high) == pytest.approx(load, rel=0.05)
    rise = [mean_force(teeth, 1.01 * high) / mean_force(teeth, high) for teeth in (plain, bent)]
    assert np.log(rise[1]) - np.log(rise[0]) == pytest.approx(0.6 * np.log(1.01), rel=0.05)


def mean_force(teeth: Teeth, dte: float) -> float:
    """Mean over a mesh cycle of the force [N] of pairs without gaps between their flanks at a deflection."""
    place = teeth.first + teeth.pitch * np.arange(teeth.stiffness.size)
    inside = (place > PATH[0]) & (place < PATH[1])
    k = np.where(inside, teeth.stiffness, 0.0)
    return float((k * dte * (dte / teeth.reference) ** teeth.exponent).sum() * teeth.pitch)


def test_flanks_have_slope_and_bow_from_peak_to_valley() -> None:
    for profile, ends in (((4e-6, 0.0), (-4e-6, 4e-6)), ((0.0, 6e-6), (-4e-6, -4e-6))):
        plain, other = (plant_of(replace(LEVELS, profile=one)).teeth for one in ((0.0, 0.0), profile))
        place = plain.first + plain.pitch * np.arange(plain.excess.size)
        more = np.interp([PATH[0] + 1e-6, PATH[1] - 1e-6], place, other.excess - plain.excess)
        assert more == pytest.approx(ends, abs=2e-8)
        inside = (place > PATH[0]) & (place < PATH[1])
        assert np.ptp((other.excess - plain.excess)[inside]) == pytest.approx(2 * profile[0] + profile[1], rel=5e-3)


def test_supports_and_damping_are_multiples_of_the_nominal_ones() -> None:
    plain, other = plant_of(LEVELS), plant_of(replace(LEVELS, support=(1.7, 0.0), damping=4.0))
    assert other.support[1] == pytest.approx(1.7 * BENCH.nominal.rig.support.driver.stiffness)
    assert (other.support[[0, 2, 3]] == plain.support[[0, 2, 3]]).all()
    assert (other.mode_stiffness == plain.mode_stiffness).all()
    # 2 zeta over the resonance of what turns on the mesh.
    mass = (plain.inertia.rotor + plain.inertia.driver) / plain.base_driver**2
    stiffness = BENCH.stiffness * RIG.stiffness_factor
    teeth, pressed = other.teeth, 100.0 / BENCH.meshing.driver.base_radius / stiffness
    factor = 1.0 - teeth.damping_load + teeth.damping_load * pressed / teeth.reference
    assert abs(factor - 1.0) > 0.1
    assert factor * teeth.damping == pytest.approx(2 * 4.0 * 0.05 / np.sqrt(stiffness / mass))
