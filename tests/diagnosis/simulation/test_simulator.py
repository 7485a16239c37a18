"""Derivatives of simulated lines: against two simulations, unknown by unknown; rigs that unknowns make."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from shared.simulated_lines import demonstration, jacobian_at, off

from gearbench.diagnosis.effects.coupling import KEY as COMPLIANCE
from gearbench.diagnosis.forces.basis import FORM_PARTS, in_parts
from gearbench.diagnosis.simulation.simulator import Simulator
from gearbench.diagnosis.structure.contrast import CONTRAST
from gearbench.diagnosis.structure.ends import ENDS, TILT
from gearbench.diagnosis.structure.layout import Layout
from gearbench.diagnosis.structure.structure import ACROSS, CROSS, GAIN, HOUSING, MODE, PHASE, housings, least_steps
from gearbench.rig import Case


@dataclass(frozen=True)
class Bench:
    layout: Layout
    simulator: Simulator
    jacobian: np.ndarray


@pytest.fixture(scope="module")
def bench() -> Bench:
    simulator = demonstration()
    return Bench(simulator.layout, simulator, jacobian_at(simulator, np.zeros(simulator.layout.size)))


CLOSE = 0.12  # of the change in any channel: modes beyond the band, and steps of a finite size


@pytest.mark.parametrize(
    ("key", "entry", "part"),
    [
        ("stiffness", 0, 0.02),
        ("damping", 1, 0.05),
        ("mass", 0, 0.05),
        ("inertia", 2, 0.05),
        ("scale", 0, 0.02),
        ("mesh-ratio", 0, 0.05),
        ("shape", 2, 0.05),
        ("eccentricity-driven", 1, 0.5),
        ("pitch-driven", 7, 0.1),
        ("bearing-driver", 0, 0.1),
        ("delay-y_driver", 0, 0.5),
        ("ripple", 3, 0.5),
        (GAIN, 0, 0.1),
        ("encoder-driver", 0, 0.5),
    ],
)
def test_a_derivative_is_what_two_simulations_differ_by(bench: Bench, key: str, entry: int, part: float) -> None:
    """`part` of the unknown's standard deviation."""
    at = bench.layout.unknowns[key].start + entry
    step = part * bench.layout.unknowns.prior()[at]
    found, largest = off(bench.simulator, bench.jacobian[at], np.zeros(bench.layout.size), at, step), 0.0
    for channel, (error, size) in found.items():
        largest = max(largest, size)
        if size > 1e-6 * largest:
            # Edges of contact that move: see EDGES of `test_structure_derivatives`.
            moved = key in ("eccentricity-driven", "pitch-driven") and channel == "torque_driven"
            edges = 0.2 if moved else CLOSE
            assert error < edges * size, channel
    assert largest > 0.0


@pytest.mark.parametrize("side", [0, 1])
def test_so_it_is_of_teeth_that_may_be_cracked(bench: Bench, side: int) -> None:
    """Of each gear one; those that may not have no derivative."""
    z1, _ = bench.layout.model.teeth
    teeth = (3, z1 + 5)
    simulator = replace(bench.simulator, layout=replace(bench.layout, teeth=teeth), _kept={})
    p, start = np.zeros(bench.layout.size), bench.layout.unknowns["crack"].start
    p[start + teeth[side]] = 0.02  # no loss is less than none
    jacobian = jacobian_at(simulator, p)
    found = off(simulator, jacobian[start + teeth[side]], p, start + teeth[side], 0.01)
    for channel, (error, size) in found.items():
        # Edges of contact that move: see EDGES of `test_structure_derivatives`.
        assert error < (0.2 if channel == "torque_driven" else CLOSE) * size, channel
    others = [one for one in range(sum(bench.layout.model.teeth)) if one not in teeth]
    assert not jacobian[start + np.array(others)].any()


@pytest.fixture(scope="module")
def turning() -> Bench:
    """A record without displacements, whose transmission error is that of the rotations."""
    simulator = demonstration(faster=4, without=("y_driver", "y_driven"))
    return Bench(simulator.layout, simulator, jacobian_at(simulator, np.zeros(simulator.layout.size)))


@pytest.mark.parametrize(
    ("key", "entry", "part"),
    [("stiffness", 0, 0.02), ("mass", 0, 0.05), ("scale", 0, 0.02), ("shape", 1, 0.05), ("ripple", 3, 0.5)],
)
def test_so_it_is_where_rotations_alone_are_measured(turning: Bench, key: str, entry: int, part: float) -> None:
    at = turning.layout.unknowns[key].start + entry
    step = part * turning.layout.unknowns.prior()[at]
    found = off(turning.simulator, turning.jacobian[at], np.zeros(turning.layout.size), at, step)
    assert set(found) == {"dte", "torque_driven"}
    assert all(error < CLOSE * size for error, size in found.values())


def test_a_late_displacement_that_is_not_measured_is_not_seen(turning: Bench) -> None:
    for channel in ("y_driver", "y_driven"):
        assert not turning.jacobian[turning.layout.unknowns.at(f"delay-{channel}")].any()


@pytest.fixture(scope="module")
def uneven() -> tuple[Simulator, np.ndarray, np.ndarray]:
    """Simulator, unknowns and Jacobian of a rig whose teeth differ by as much as its mesh is pressed."""
    simulator = demonstration()
    unknowns, p = simulator.layout.unknowns, np.zeros(simulator.layout.size)
    for key in ("pitch-driver", "pitch-driven"):
        at = unknowns.at(key)
        p[at] = 6e-6 * np.cos(2.4 * np.arange(len(at)))
    p[unknowns["curvature"]] = 0.1
    return simulator, p, jacobian_at(simulator, p)


@pytest.mark.parametrize(
    ("key", "part", "within"),
    [("curvature", 0.1, 0.06), (CONTRAST, 0.1, 0.06), ("scale", 0.1, 0.06), (ENDS, 0.02, 0.07),
     (TILT, 0.05, 0.07)],
)
def test_teeth_that_differ_are_each_as_far_up_the_law_as_they_are_pressed(
    uneven: tuple[Simulator, np.ndarray, np.ndarray], key: str, part: float, within: float
) -> None:
    simulator, p, jacobian = uneven
    at = simulator.layout.unknowns[key].start
    found = off(simulator, jacobian[at], p, at, part * simulator.layout.unknowns.prior()[at])
    for channel, (error, size) in found.items():
        # Edges of contact that move: see EDGES of `test_structure_derivatives`.
        assert error < (0.25 if channel == "torque_driven" else within) * size, channel


@pytest.fixture(scope="module")
def nudged() -> tuple[Simulator, np.ndarray]:
    """Simulator and Jacobian where the driver is nudged towards its recorded motion."""
    simulator = replace(demonstration(), nudges={"base": 4e4})
    return simulator, jacobian_at(simulator, np.zeros(simulator.layout.size))


@pytest.mark.parametrize(
    ("key", "entry", "part"),
    [
        ("stiffness", 0, 0.02),
        ("damping", 1, 0.05),
        ("inertia", 0, 0.05),
        ("scale", 0, 0.02),
        ("shape", 2, 0.05),
        ("ripple", 3, 0.5),
        ("delay-angle_driver", 0, 0.5),
        ("encoder-driver", 0, 0.5),
        ("encoder-driver", 1, 0.5),
    ],
)
def test_a_derivative_of_a_nudged_motion_is_what_two_of_them_differ_by(
    nudged: tuple[Simulator, np.ndarray], key: str, entry: int, part: float
) -> None:
    """The driver's sensor moves what it is nudged towards."""
    simulator, jacobian = nudged
    p, at = np.zeros(simulator.layout.size), simulator.layout.unknowns[key].start + entry
    found = off(simulator, jacobian[at], p, at, part * simulator.layout.unknowns.prior()[at])
    largest = max(size for _, size in found.values())
    for channel, (error, size) in found.items():
        if size > 1e-6 * largest:
            assert error < CLOSE * size, channel


@pytest.mark.parametrize(
    "form", [*np.eye(len(FORM_PARTS))[[0, 3, 6]], *FORM_PARTS[1:3]], ids=[*"036", "slope", "barrelling"]
)
def test_the_derivative_by_a_form_of_the_flanks_is_close(bench: Bench, form: np.ndarray) -> None:
    """At places along the path, and of two parts. Between the nodes of two tables; supports feel what is left where the
    error takes up nearly all of the form."""
    at, along = bench.layout.unknowns["flanks"], in_parts(form)
    step = 0.1 * bench.layout.model.deflection
    found = off(bench.simulator, along @ bench.jacobian[at], np.zeros(bench.layout.size), at, step, along)
    for channel, within in (("dte", 0.06), ("y_driver", 0.2), ("y_driven", 0.2)):
        error, size = found[channel]
        assert error < within * size, channel


@pytest.fixture(scope="module")
def sloping() -> tuple[Simulator, np.ndarray, np.ndarray]:
    """Simulator, unknowns and Jacobian of a rig whose flanks slope so steeply towards the end of the path that they
    touch a fiftieth of a base pitch beside where involutes would."""
    simulator = demonstration()
    p, at = np.zeros(simulator.layout.size), simulator.layout.unknowns["flanks"]
    p[at] = simulator.layout.model.deflection * in_parts(np.array([0.0, 0.3, 0.0, 0.0, 0.6, -1.5, 0.3]))
    return simulator, p, jacobian_at(simulator, p)


@pytest.mark.parametrize(
    ("form", "within"),
    [(np.eye(len(FORM_PARTS))[4], 0.06), (np.eye(len(FORM_PARTS))[5], 0.1), (FORM_PARTS[2], 0.04)],
    ids=["4", "5", "barrelling"],
)
def test_so_it_is_of_flanks_that_slope(
    sloping: tuple[Simulator, np.ndarray, np.ndarray], form: np.ndarray, within: float
) -> None:
    """Taken where involutes touch, the derivatives are 0.07, 0.22 and 0.07 off."""
    simulator, p, jacobian = sloping
    at, along = simulator.layout.unknowns["flanks"], in_parts(form)
    step = 0.02 * simulator.layout.model.deflection
    error, size = off(simulator, along @ jacobian[at], p, at, step, along)["dte"]
    assert error < within * size


def test_run_out_of_the_driven_encoder_is_seen_in_the_error_alone(bench: Bench) -> None:
    """The simulated gear turns as it was recorded, less that run-out, which shakes the rig a hundred times less."""
    at = bench.layout.unknowns["encoder-driven"].start
    step = 0.5 * bench.layout.unknowns.prior()[at]
    found = off(bench.simulator, bench.jacobian[at], np.zeros(bench.layout.size), at, step)
    error, size = found.pop("dte")
    assert error < CLOSE * size
    for channel in ("y_driver", "y_driven"):
        assert found[channel][1] < 0.01 * size, channel


@pytest.mark.parametrize(("key", "entries"), [(ACROSS, (0, 1)), (HOUSING, (0,)), (HOUSING, (1,))])
def test_structure_that_is_not_there_has_a_derivative(bench: Bench, key: str, entries: tuple[int, ...]) -> None:
    """A fit that begins with a rigid structure is told that a softer one would come closer: supports across have one
    direction for both, as a rig has them at both gears."""
    unknowns, p = bench.layout.unknowns, np.zeros(bench.layout.size)
    here = bench.simulator.lines(p)
    at = [unknowns[key].start + entry for entry in entries]
    p[at] = 0.06
    softer = bench.simulator.lines(p)
    assert here is not None and softer is not None
    change, column = (softer - here) / 0.06, bench.jacobian[at[0]]
    along = float(np.vdot(column, change).real / np.linalg.norm(change) ** 2)
    assert 0.5 < along < 2.0


def test_unknowns_make_the_rig_that_they_name(bench: Bench) -> None:
    layout, unknowns = bench.layout, bench.layout.unknowns
    p = np.zeros(layout.size)
    assert layout.case(p).rig.support.driver.across is None and layout.case(p).rig.drive.ripple is None
    p[unknowns["stiffness"]] = 0.1, -0.1
    p[unknowns["friction"]] = 0.05
    p[unknowns["eccentricity-driver"]] = 3e-6, 4e-6
    p[unknowns["crack"].start + 3] = 0.3
    p[unknowns["crack"].start + 5] = 0.4  # no tooth that may be cracked
    p[unknowns[ACROSS]] = 0.2, 0.1
    p[unknowns["encoder-driven"].start + 1] = 1e-6
    p[unknowns["delay-y_driven"]] = 2e-5
    p[unknowns["ripple"].start : unknowns["ripple"].start + 2] = 0.0, 1.5
    p[unknowns[CROSS]] = 0.1, -0.2
    p[unknowns[HOUSING]], p[unknowns[MODE].start] = 0.06, -0.2
    rig = layout.case(p, "base").rig
    assert rig.support.driver.stiffness == pytest.approx(1e8 * np.exp(0.1))
    assert rig.support.driver.across is not None and rig.support.driven.across is not None
    assert rig.support.driver.across.stiffness == pytest.approx(5 * 1e8 * np.exp(0.1))
    # A tenth of the root of 1e8 and 5e8, softer or stiffer by the same factor.
    assert rig.support.driver.across.coupling == pytest.approx(0.1 * np.sqrt(5) * 1e8 * np.exp(0.1))
    # 6 % of the supports' compliance; gears of 2 and 3 kg on 1e8 N/m: 2.5 kg on average; a twentieth of critical.
    housing, frequency = rig.housing, np.sqrt(1e8 / 2.5) * np.exp(-0.2)
    assert housing is not None and housing.stiffness == pytest.approx(1e8 / 0.06)
    assert np.sqrt(housing.stiffness / housing.mass) == pytest.approx(frequency)
    assert housing.damping == pytest.approx(2 * 0.05 * frequency * housing.mass)
    assert 2e8 < layout.model.mesh_stiffness < 5e8
    assert rig.friction.coefficient == pytest.approx(0.05)
    assert rig.driver.runout == pytest.approx(1e-5) and rig.driver.runout_phase == pytest.approx(np.arctan2(4, 3))
    assert rig.driver.crack is None  # a gear has one crack, and the largest loss is none of a tooth that may be
    assert rig.sensors.delay_y_driven == 2e-5
    assert rig.sensors.encoder_runout_driven == pytest.approx(1e-6 / layout.model.base_radius[1])
    assert rig.sensors.encoder_runout_driven_phase == pytest.approx(np.pi / 2)
    assert rig.drive.ripple is not None and rig.drive.ripple.amplitude[0] == pytest.approx(1.5)
    # 1.5 sin is 1.5 cos(.. - pi/2)
    assert rig.drive.ripple.phase[0] == pytest.approx(-np.pi / 2)


def test_a_housing_is_tried_at_several_frequencies_where_the_nominal_rig_has_none(bench: Bench) -> None:
    trials = housings(bench.layout.unknowns, np.zeros(bench.layout.size))
    cases = [bench.layout.case(p).rig.housing for p in trials]
    tried = {(one.mass, one.driven_share) for one in cases[1:] if one is not None}
    assert cases[0] is None and len(tried) == len(cases) - 1 == 8


def test_what_no_rig_may_have_is_no_answer(bench: Bench) -> None:
    p = np.zeros(bench.layout.size)
    p[bench.layout.unknowns["inertia"]] = -0.9
    assert bench.simulator.lines(p) is None
    assert bench.simulator.jacobian(p, bench.layout.unknowns.prior(), np.ones(p.size, dtype=bool)) is None


@pytest.mark.parametrize(("key", "entry", "part"), [(CONTRAST, 0, 0.05), ("shape", 2, 0.05), (PHASE, 0, 0.05)])
def test_a_mesh_that_changes_more_over_its_phase_is_moved_along_it(key: str, entry: int, part: float) -> None:
    """With a series in its phase, which moves with it."""
    simulator = demonstration()
    unknowns = simulator.layout.unknowns
    p = np.zeros(unknowns.size)
    p[unknowns[CONTRAST]], p[unknowns[PHASE]] = 0.2, 0.004
    at = unknowns[key].start + entry
    found = off(simulator, jacobian_at(simulator, p)[at], p, at, part * unknowns.prior()[at])
    for channel, (error, size) in found.items():
        close = 0.06 if channel == "torque_driven" else 0.01
        # What the pairs share moves the edges of their contact, where damping jumps: the derivative leaves that out.
        close *= 2.0 if key == CONTRAST else 1.0
        # Edges of contact zones jump between steps of the grid, which excites what lies beyond the band.
        edges = 0.25 if channel == "torque_driven" else 0.08
        assert 0.0 < error < (edges if key == PHASE else close) * size, channel


def test_a_coupling_that_no_line_shows_is_left_out_of_the_rig(bench: Bench) -> None:
    """Ten times above the mesh's resonance; every step would have to follow it."""
    layout, unknowns = bench.layout, bench.layout.unknowns
    at, least = unknowns[COMPLIANCE].start, least_steps(unknowns)[COMPLIANCE]
    stiff, soft = (layout.case(np.where(np.arange(layout.size) == at, part * least, 0.0)).rig for part in (0.99, 1.0))
    assert not stiff.drive.twists and soft.drive.twists
    coupling = soft.drive.coupling
    assert coupling is not None and coupling.stiffness is not None
    reduced = 1.0 / (1.0 / coupling.inertia + 1.0 / layout.model.inertia[0])
    ratio = np.sqrt(coupling.stiffness / reduced) / (2 * np.pi * layout.model.resonance)
    assert ratio == pytest.approx(0.67 / np.sqrt(4e-3), rel=1e-6)
    # It is looked for from none by as much: a smaller step would show no derivative.
    assert np.abs(bench.jacobian[at]).max() > 0.0


def test_of_an_unknown_that_no_rig_may_have_more_of_the_other_sense_tells(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    at, size = bench.layout.unknowns[COMPLIANCE].start, bench.layout.size
    p, chosen = np.zeros(size), np.arange(size) == at
    p[at] = 5.0 * least_steps(bench.layout.unknowns)[COMPLIANCE]
    plain = bench.simulator.moved(p, bench.layout.unknowns.prior(), chosen)
    made = Layout.case

    def case(layout: Layout, values: np.ndarray, condition: str | None = None) -> Case:
        if values[at] > p[at]:
            raise ValueError("no rig may have as much")
        return made(layout, values, condition)

    monkeypatch.setattr(Layout, "case", case)
    found = bench.simulator.moved(p, bench.layout.unknowns.prior(), chosen)
    assert plain is not None and found is not None
    assert np.linalg.norm(found[at] - plain[at]) < 0.3 * np.linalg.norm(plain[at])
