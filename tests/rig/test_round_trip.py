"""`read_case(dump_case(case))` is `case` again, for random cases."""

from __future__ import annotations

from math import pi, radians
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearbench.rig import (
    Case,
    Condition,
    Coupling,
    Crack,
    Damping,
    Drive,
    Experiment,
    Friction,
    Gear,
    Identification,
    Load,
    Material,
    MeshCorrection,
    Multisine,
    Rig,
    Ripple,
    Sensors,
    Simulation,
    Support,
    Supports,
    dump_case,
    read_case,
)
from gearbench.rig.value import UNITS, format_number, from_si, to_si


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_subnormal=False)


def maybe(strategy: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.none() | strategy


CRACKS = st.builds(Crack, tooth=st.integers(0, 4), stiffness_loss=number(0, 0.95)) | st.builds(
    Crack, tooth=st.integers(0, 4), length=number(0, 0.2), direction=number(-0.5, 2.6), start=number(0, 1.57)
)
ERRORS = st.integers(5, 12).flatmap(
    lambda teeth: st.fixed_dictionaries(
        {"teeth": st.just(teeth), "pitch_error": st.lists(number(-1e-3, 1e-3), min_size=teeth, max_size=teeth)}
    )
)


def gear_of(shape: dict[str, Any], **fields: Any) -> Gear:
    return Gear(**{**fields, **shape})


GEARS = st.builds(
    gear_of,
    shape=st.fixed_dictionaries({"teeth": st.integers(5, 1000)}) | ERRORS,
    module=number(1e-4, 0.1),
    pressure_angle=number(radians(11), radians(34)),
    profile_shift=number(-1.5, 2),
    tip_diameter=maybe(number(1e-3, 1)),
    tip_edge_radius=number(0, 1e-3),
    thinning=number(0, 5e-3),
    face_width=number(1e-4, 1),
    bore_radius=number(0, 1),
    hub_radius=number(1e-3, 1),
    mass=maybe(number(1e-6, 1e3)),
    inertia=maybe(number(1e-9, 1e3)),
    runout=number(0, 1e-3),
    runout_phase=number(-7, 7),
    crack=maybe(CRACKS),
)
SUPPORTS = st.builds(
    Support,
    stiffness=number(1, 1e12),
    damping=number(0, 1e9),
    exponent=number(-0.89, 3),
    reference_deflection=number(1e-9, 1e-2),
)
COUPLINGS = st.builds(Coupling, inertia=number(1e-9, 1e3)) | st.builds(
    Coupling, inertia=number(1e-9, 1e3), stiffness=number(1, 1e9), damping=number(0, 1e3)
)


def ripple_of(terms: dict[int, tuple[float, float]]) -> Ripple:
    amplitude, phase = ([term[i] for term in terms.values()] for i in (0, 1))
    return Ripple(orders=tuple(terms), amplitude=tuple(amplitude), phase=tuple(phase))


RIPPLES = st.builds(
    ripple_of, st.dictionaries(st.integers(1, 10_000), st.tuples(number(0, 1e3), number(-7, 7)), max_size=4)
)
SERIES = st.lists(st.tuples(number(-0.1, 0.1), number(-0.1, 0.1)), max_size=5)


def mesh_of(scale: float, stiffness: list[tuple[float, float]], error: list[tuple[float, float]]) -> MeshCorrection:
    return MeshCorrection(
        exponent=0.1 * scale,
        reference_force=100.0 * scale,
        stiffness_scale=scale,
        stiffness_cos=tuple(c for c, _ in stiffness),
        stiffness_sin=tuple(s for _, s in stiffness),
        error_mean=1e-6 * scale,
        error_cos=tuple(1e-3 * c for c, _ in error),
        error_sin=tuple(1e-3 * s for _, s in error),
    )


MULTISINES = st.one_of(
    st.builds(Multisine, amplitude=number(1e-6, 1e3), band=st.just((1.0, 1234.5))),
    st.builds(
        Multisine, rms=number(1e-6, 1e3), band=st.tuples(number(0, 10), number(11, 4000)), grid=st.just("odd")
    ),
    st.builds(
        Multisine,
        rms=number(1e-6, 1e3),
        band=st.just((1.0, 1234.5)),
        grid=st.just("comb"),
        residue=maybe(st.integers(1, 10**9)),
    ),
)


def experiments(multisine: st.SearchStrategy[Any]) -> st.SearchStrategy[Experiment]:
    common: dict[str, Any] = {
        "torque_mean": number(1e-3, 1e6),
        "sampling_rate": number(8192, 1e6),
        "samples_per_period": st.integers(16, 2**24),
        "periods": st.integers(1, 100),
        "seed": st.integers(0, 2**63 - 1),
        "multisine": multisine,
    }
    return st.builds(Experiment, mesh_frequency=number(1e-3, 1e4), **common) | st.builds(
        Experiment, speed_driver=number(1e-3, 1e4), **common
    )


# All of ASCII, and of the rest what files and readers of text treat in its own way.
SIGNS = [*map(chr, range(128)), *"\x7f\x85\xa0µéß\u0301\u200b\u2028\u2029\ufeff\uffff中😀\U0010ffff"]
NAMES = st.text(st.sampled_from(SIGNS), min_size=1).filter(str.strip)

CASES = st.builds(
    Case,
    name=NAMES,
    rig=st.builds(
        Rig,
        centre_distance=maybe(number(1e-3, 10)),
        driver=GEARS,
        driven=GEARS,
        material=st.builds(
            Material,
            youngs_modulus=number(1e6, 2e12),
            state=st.sampled_from(["plane-stress", "plane-strain"]),
        ),
        support=st.builds(
            Supports,
            driver=SUPPORTS,
            driven=SUPPORTS,
            direction=st.sampled_from(["tangential", "line-of-action"]),
        ),
        load=st.builds(Load, boundary=st.sampled_from(["speed", "torque"])),
        damping=st.builds(Damping, material_ratio=number(0, 0.49)),
        drive=st.builds(Drive, coupling=maybe(COUPLINGS), ripple=maybe(RIPPLES)),
        friction=st.builds(Friction, coefficient=number(0, 1), transition_speed=number(1e-6, 10)),
        mesh=st.builds(mesh_of, number(0.01, 10), SERIES, SERIES),
        sensors=st.builds(Sensors, delay_y_driven=number(-0.1, 0.1), noise_angle=number(0, 1)),
    ),
    experiment=experiments(maybe(MULTISINES)),
    simulation=st.builds(Simulation, element_size=maybe(number(1e-6, 1e-2)), modes=st.integers(0, 60)),
    identification=st.builds(Identification, band=maybe(st.just((0.1, 3000.7)))),
    uncertainty=st.dictionaries(
        st.sampled_from(["rig.driver.module", "rig.support.driven.stiffness", "experiment.torque_mean"]),
        number(0, 1e9),
    ),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cases")


def again(case: Case, folder: Path) -> Case:
    path = folder / "case.toml"
    path.write_text(dump_case(case), encoding="utf-8", newline="")
    return read_case(path)


@settings(max_examples=25, deadline=None)
@given(case=CASES)
def test_random_cases_survive_unchanged(case: Case, folder: Path) -> None:
    assert again(case, folder) == case


@settings(max_examples=15, deadline=None)
@given(case=CASES, first=experiments(MULTISINES), second=experiments(MULTISINES))
def test_conditions_survive_unchanged(
    case: Case, first: Experiment, second: Experiment, folder: Path
) -> None:
    conditions = (Condition(name="one", experiment=first), Condition(name="t-2", experiment=second))
    case = case.model_copy(
        update={"conditions": conditions, "uncertainty": {"conditions.1.experiment.torque_mean": 0.25}}
    )
    assert again(case, folder) == case


@given(
    value=st.floats(-1e290, 1e290, allow_subnormal=False),
    unit=st.sampled_from(sorted(UNITS)),
)
def test_every_float_survives_its_unit(value: float, unit: str) -> None:
    assert to_si(from_si(value, unit), unit) == value


def test_written_numbers_stay_short() -> None:
    assert format_number(0.002, "mm") == "2.0"
    assert format_number(0.0175, "mm") == "17.5"
    assert format_number(50e-6, "um") == "50.0"
    assert format_number(20 * pi / 180, "deg") == "20.0"
    assert format_number(206e9, "gpa") == "206.0"
    assert format_number(2 * pi, "rpm") == "60.0"
    assert format_number(3.6025e-3, "kg_m2") == "0.0036025"
