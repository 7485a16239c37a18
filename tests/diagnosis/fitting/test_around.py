"""What is read of a rig around its mesh, from records made by equations of motion that are written out here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gearbench.bench import simulate
from gearbench.cases import case_files
from gearbench.diagnosis.effects.coupling import KEY as COMPLIANCE
from gearbench.diagnosis.effects.coupling import LOSS
from gearbench.diagnosis.evidence.problem import problem_of
from gearbench.diagnosis.fitting.answering import System, left_over, left_over_moved, lines_of, slopes_of, system_of
from gearbench.diagnosis.fitting.around import KEYS, MOVED, REACTION, around
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.nominal import nominal_model
from gearbench.diagnosis.forces.residuals import LOSS_FACTOR
from gearbench.diagnosis.intake.measurements import measurement
from gearbench.diagnosis.structure.layout import Layout, layout_of
from gearbench.diagnosis.structure.structure import (
    ACROSS,
    CROSS,
    HOUSED,
    HOUSING,
    MODE,
    SEAT,
    SHAPE,
    kind_of,
    least_steps,
)
from gearbench.rig import read_case

K1, K2, SOFTNESS, RATIO = 0.93e8, 1.08e8, 0.06, 0.05  # stiffness of the supports, compliance of the housing, damping


@pytest.fixture(scope="module")
def rig() -> tuple[Layout, Condition]:
    nominal = read_case(case_files()["gap_demo"])
    measured = measurement(simulate(nominal.under(nominal.conditions[0])), "base", nominal)
    problem = problem_of([measured], nominal)
    return layout_of(nominal, problem.model, problem.conditions, ()), problem.conditions[0]


def recorded(
    layout: Layout,
    like: Condition,
    frequency: float | None,
    heavier: float = 1.0,
    shares: tuple[float, float] = (1.0, 1.0),
    late: float = 0.0,
    seat: float = 0.0,
    parted: bool = False,
    coupling: tuple[float, float] | None = None,
    more: tuple[float, tuple[float, float]] | None = None,
) -> Condition:
    """A condition whose rig has a housing of that logarithm of frequency (None: none), of which the supports make these
    shares (`more`: both of another motion), a late sensor of the driver's displacement [s], displacement sensors that
    make a part `seat` of the supports' motion, and any force in the mesh, `parted` half of the time; `coupling`:
    stiffness [N m/rad] and damping of what is between rotor and driver."""
    m = layout.model
    rng = np.random.default_rng(3)
    omega = like.omega[: like.bins]
    torque = like.spectra["torque_driver"][: like.bins]
    force = 300.0 * (rng.standard_normal(like.bins) + 1j * rng.standard_normal(like.bins))
    if parted:
        force = np.fft.rfft(np.maximum(np.fft.irfft(force), 0.0))[: like.bins]
    mean = 2 / (1 / m.stiffness[0] + 1 / m.stiffness[1])
    big, s = mean / SOFTNESS, 1j * omega
    mass = heavier * (m.inertia[0] + m.rotor) / m.base_radius[0] ** 2
    turning = (torque / m.base_radius[0] - force) / (mass * s**2 + (omega == 0))
    if coupling is not None:
        driver, rotor = (one / m.base_radius[0] ** 2 for one in (m.inertia[0], m.rotor))
        twisted = (coupling[0] + s * coupling[1]) / m.base_radius[0] ** 2
        passed = twisted / (rotor * s**2 + twisted)
        moving = driver * s**2 + passed * rotor * s**2 + (omega == 0)
        turning = (passed * torque / m.base_radius[0] - force) / moving
    one, two = (k + s * c for k, c in zip((K1, K2), m.damping, strict=True))
    motions = [(frequency, shares)] if frequency is not None else []
    motions += [more] if more is not None else []
    rows = np.zeros((2 + len(motions), 2 + len(motions), len(omega)), dtype=complex)
    rows[0, 0], rows[1, 1] = m.mass[0] * s**2 + one, m.mass[1] * s**2 + two
    for number, (at, (a, b)) in enumerate(motions, start=2):
        heavy = np.exp(-2.0 * at) * 0.5 * (m.mass[0] + m.mass[1]) * big / mean
        rows[number, number] += big + s * 2 * RATIO * np.sqrt(big * heavy) + s**2 * heavy
        rows[0, number] = rows[number, 0] = -a * one
        rows[1, number] = rows[number, 1] = -b * two
        for other, (_, (c, d)) in enumerate(motions, start=2):
            rows[number, other] += a * c * one + b * d * two
    push = np.array([-m.support_factor * force, m.support_factor * force, *(0 * force for _ in motions)])
    moved = np.linalg.solve(np.moveaxis(rows, 2, 0), push.T[..., None])[:, :, 0].T
    y = moved[:2].copy()
    for number, (_, both) in enumerate(motions, start=2):
        y -= seat * np.outer(both, moved[number])
    # The driven gear turns with a load of ten times its inertia, of which it takes its own part of the force.
    driven = force * m.base_radius[1] ** 2 / (11 * m.inertia[1] * s**2 + (omega == 0))
    reaction = m.base_radius[1] * force - m.inertia[1] * s**2 * driven / m.base_radius[1]
    spectra = {"torque_driver": like.spectra["torque_driver"], "angle_driver": turning, "angle_driven": driven,
               "y_driver": y[0] * np.exp(-s * late), "y_driven": y[1], "torque_driven": reaction}  # fmt: skip
    noise = {name: 1e-8 * float(np.median(np.abs(values[1 : like.bins]) ** 2)) for name, values in spectra.items()}
    return replace(like, spectra=spectra, noise=noise)


def turning(layout: Layout, found: NDArray[np.float64]) -> float:
    """Inertia of what turns at the driver, over the nominal one."""
    driver, _, rotor = np.exp(found[layout.unknowns["inertia"]])
    parts = np.array([layout.model.inertia[0], layout.model.rotor])
    return float(parts @ [driver, rotor] / parts.sum())


@pytest.mark.validation
@pytest.mark.parametrize("frequency", [-1.0, -0.3, 0.4])
def test_a_housing_is_found_with_the_supports(rig: tuple[Layout, Condition], frequency: float) -> None:
    layout, like = rig
    found = around(layout, [recorded(layout, like, frequency)], np.zeros(layout.size))
    assert found is not None
    unknowns, model = layout.unknowns, layout.model
    assert found[unknowns["stiffness"]] == pytest.approx(np.log([K1, K2] / np.array(model.stiffness)), abs=0.005)
    assert found[unknowns[HOUSING]] == pytest.approx([SOFTNESS, 0.0], abs=0.05 * SOFTNESS)
    assert found[unknowns[MODE]][:2] == pytest.approx([frequency, 0.0], abs=0.1)


def test_a_housing_that_rocks_is_found_a_late_sensor_and_inertia(rig: tuple[Layout, Condition]) -> None:
    layout, like = rig
    shares, late = (1.0, -0.8), 6e-6
    found = around(layout, [recorded(layout, like, 0.3, 1.02, shares, late)], np.zeros(layout.size))
    assert found is not None
    assert turning(layout, found) == pytest.approx(1.02, abs=0.003)
    unknowns, size = layout.unknowns, (shares[0] ** 2 + shares[1] ** 2) / 2
    assert found[unknowns[HOUSING]] == pytest.approx([0.0, size * SOFTNESS], abs=0.03 * SOFTNESS)
    assert found[unknowns[MODE]][2] == pytest.approx(0.3, abs=0.01)
    assert np.tan(found[unknowns[SHAPE]][1] - np.pi / 4) == pytest.approx(shares[1] / shares[0], abs=0.02)
    assert found[unknowns["delay-y_driver"]][0] == pytest.approx(late, rel=0.05)


def test_a_housing_of_which_both_motions_rock_is_found(rig: tuple[Layout, Condition]) -> None:
    layout, like = rig
    record = recorded(layout, like, -0.9, shares=(1.0, -0.9), more=(0.2, (0.7, -1.0)))
    found = around(layout, [record], np.zeros(layout.size))
    assert found is not None
    unknowns = layout.unknowns
    assert sorted(found[unknowns[MODE]][[0, 2]]) == pytest.approx([-0.9, 0.2], abs=0.02)
    assert kind_of(unknowns, found, 0) == kind_of(unknowns, found, 1) == "rocking"
    assert found[unknowns["stiffness"]] == pytest.approx(np.log([K1, K2] / np.array(layout.model.stiffness)), abs=0.01)


@pytest.mark.parametrize(("first", "second"), [
    ((0.9, (1.0, -1.0)), (0.2, (1.0, 0.3))),
    # Both move along: the mesh pushes both gears apart, so that they answer faintly.
    ((0.9, (0.7, 0.9)), (-0.2, (1.0, 0.9))),
])  # fmt: skip
def test_two_motions_are_found_of_which_neither_explains_most_alone(
    rig: tuple[Layout, Condition], first: tuple[float, tuple[float, float]], second: tuple[float, tuple[float, float]]
) -> None:
    layout, like = rig
    found = around(layout, [recorded(layout, like, first[0], shares=first[1], more=second)], np.zeros(layout.size))
    assert found is not None
    unknowns = layout.unknowns
    assert sorted(found[unknowns[MODE]][[0, 2]]) == pytest.approx(sorted([first[0], second[0]]), abs=0.02)
    true = np.log([K1, K2] / np.array(layout.model.stiffness))
    assert found[unknowns["stiffness"]] == pytest.approx(true, abs=0.005)


def test_what_no_rig_may_have_costs_its_trial_not_the_rig(
    rig: tuple[Layout, Condition], monkeypatch: pytest.MonkeyPatch
) -> None:
    layout, like = rig
    at = layout.unknowns[HOUSING]

    def some(layout: Layout, p: NDArray[np.float64]) -> System:
        if p[at].max() > 0.01:
            raise ValueError("no rig has such a housing")
        return system_of(layout, p)

    monkeypatch.setattr("gearbench.diagnosis.fitting.around.system_of", some)
    found = around(layout, [recorded(layout, like, 0.4)], np.zeros(layout.size))
    assert found is not None and found[at].max() <= 0.01


@pytest.mark.parametrize("parted", [False, True])
def test_sensors_on_the_housing_are_found_with_it(rig: tuple[Layout, Condition], parted: bool) -> None:
    layout, like = rig
    shares = (1.0, -0.8)
    record = recorded(layout, like, -0.3, shares=shares, seat=1.0, parted=parted)
    found = around(layout, [record], np.zeros(layout.size))
    assert found is not None
    unknowns, size = layout.unknowns, (shares[0] ** 2 + shares[1] ** 2) / 2
    assert found[unknowns[SEAT]] == pytest.approx([1.0], abs=0.05)
    assert found[unknowns[HOUSING]] == pytest.approx([0.0, size * SOFTNESS], abs=0.05 * SOFTNESS)
    assert found[unknowns[MODE]][2] == pytest.approx(-0.3, abs=0.02)


@pytest.mark.validation
def test_inertia_is_read_from_the_driver(rig: tuple[Layout, Condition]) -> None:
    layout, like = rig
    found = around(layout, [recorded(layout, like, -0.3, heavier=1.02)], np.zeros(layout.size))
    assert found is not None and turning(layout, found) == pytest.approx(1.02, abs=0.003)


def test_a_coupling_is_found_where_there_is_one(rig: tuple[Layout, Condition]) -> None:
    """Begun at a compliance of two thirds, with the loss factor that the residuals assume."""
    layout, like = rig
    reduced = 1 / (1 / layout.model.rotor + 1 / layout.model.inertia[0])
    omega = 2 * np.pi * 1500.0
    stiffness, loss = omega**2 * reduced, 0.09
    true = recorded(layout, like, None, coupling=(stiffness, loss * stiffness / omega))
    held = np.zeros(layout.size)
    held[layout.unknowns[COMPLIANCE]] = 0.67 / stiffness
    found = around(layout, (true,), held)
    assert found is not None
    assert found[layout.unknowns[COMPLIANCE]] == pytest.approx(1 / stiffness, rel=0.01)
    assert LOSS_FACTOR * np.exp(found[layout.unknowns[LOSS]]) == pytest.approx(loss, rel=0.1)
    assert turning(layout, found) == pytest.approx(1.0, abs=0.01)
    stays = around(layout, (recorded(layout, like, None),), np.zeros(layout.size))
    assert stays is not None and stays[layout.unknowns[COMPLIANCE]] == 0.0


def test_a_stated_coupling_may_be_stiffer_than_the_case_says(rig: tuple[Layout, Condition]) -> None:
    layout, like = rig
    case = layout.nominal
    reduced = 1 / (1 / layout.model.rotor + 1 / layout.model.inertia[0])
    omega = 2 * np.pi * 1500.0
    stiffness, loss = omega**2 * reduced, 0.09
    assert case.rig.drive.coupling is not None
    said = {"stiffness": stiffness / 1.1, "damping": 0.07 * stiffness / 1.1 / omega}
    drive = case.rig.drive.model_copy(update={"coupling": case.rig.drive.coupling.model_copy(update=said)})
    case = case.model_copy(update={"rig": case.rig.model_copy(update={"drive": drive})})
    mean = layout.model.torque_mean
    stated = layout_of(case, nominal_model(case, 2.0 * mean, mean), [like], ())
    nothing = stated.case(np.zeros(stated.size)).rig.drive.coupling
    assert nothing is not None and (nothing.stiffness, nothing.damping) == pytest.approx(tuple(said.values()))
    # It is there from the beginning: nothing has to be a jump's length away to be felt.
    assert COMPLIANCE in least_steps(layout.unknowns) and COMPLIANCE not in least_steps(stated.unknowns)
    true = recorded(stated, like, None, coupling=(stiffness, loss * stiffness / omega))
    found = around(stated, (true,), np.zeros(stated.size))
    assert found is not None
    coupling = stated.case(found).rig.drive.coupling
    assert coupling is not None and coupling.stiffness == pytest.approx(stiffness, rel=0.01)
    assert coupling.damping == pytest.approx(loss * stiffness / omega, rel=0.1)
    assert turning(stated, found) == pytest.approx(1.0, abs=0.01)


def test_no_housing_is_hardly_any(rig: tuple[Layout, Condition]) -> None:
    layout, like = rig
    found = around(layout, [recorded(layout, like, None)], np.zeros(layout.size))
    assert found is not None and found[layout.unknowns[HOUSING]].max() < 0.005
    assert found[layout.unknowns["stiffness"]] == pytest.approx(np.log([K1 / 1e8, K2 / 1e8]), abs=0.005)


def test_without_displacements_nothing_is_read(rig: tuple[Layout, Condition]) -> None:
    layout, like = rig
    spectra = {name: values for name, values in like.spectra.items() if not name.startswith("y_")}
    assert around(layout, [replace(like, spectra=spectra)], np.zeros(layout.size)) is None


@pytest.mark.parametrize("level", [0.1, 0.01])
def test_derivatives_are_those_of_differences(rig: tuple[Layout, Condition], level: float) -> None:
    layout, like = rig
    unknowns = layout.unknowns
    lines = lines_of(layout.model, recorded(layout, like, -0.3, seat=1.0), (*MOVED, REACTION), 60)
    assert lines is not None
    p = np.zeros(layout.size)
    for key, value in ((HOUSING, 0.02), (CROSS, 0.05), (ACROSS, 0.2), (SEAT, 0.5), ("delay-y_driver", 4e-6)):
        p[unknowns[key]] = value
    at = np.flatnonzero(unknowns.of((*KEYS, *HOUSED)) & (unknowns.prior() > 0.0))
    sd = unknowns.prior()[at]
    system = system_of(layout, p)
    _, found = left_over_moved(layout, system, slopes_of(layout, p, system, at, sd), lines, level)
    assert (np.abs(found).max(axis=1) > 0.0).sum() > 20
    for index, width, slope in zip(at, sd, found, strict=True):
        step = 1e-5 * width * (np.arange(unknowns.size) == index)
        high, low = (left_over(layout, system_of(layout, one), lines, (level,))[0] for one in (p + step, p - step))
        wanted = (high - low) / (2e-5 * width)
        assert np.abs(slope - wanted).max() <= 1e-3 * np.abs(wanted).max()
