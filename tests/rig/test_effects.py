"""Effects that an ideal rig lacks: their units, their neutral values, which of them a rig has, and refusals."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import pytest

from gearbench.cases import case_path
from gearbench.rig import Case, CaseError, Rig, dump_case, effects_in, read_case, sound_gear

REFERENCE = case_path("reference")  # 62/62 teeth
COUPLING = "rig.drive.coupling={inertia_kg_m2 = 2e-3, stiffness_nm_per_rad = 5e4, damping_nm_s_per_rad = 1.5}"
RIPPLE = "rig.drive.ripple={orders = [6, 12], amplitude_nm = [0.6, 0.3], phase_deg = [0, 90]}"
SLIT = "rig.driver.crack={tooth = 7, length_mm = 0.8, direction_deg = 60}"
ACROSS = "rig.support.driven.across={stiffness_n_per_m = 2e7, damping_n_s_per_m = 300, coupling_n_per_m = -3e6}"
HOUSING = "rig.housing={mass_kg = 40, stiffness_n_per_m = 1e9, damping_n_s_per_m = 2e3}"
SHAFT = "rig.load.coupling={inertia_kg_m2 = 0.02, stiffness_nm_per_rad = 4e4, damping_nm_s_per_rad = 2}"
FREE = "rig.load.boundary=inertia"
CONSTANT = "experiment={mesh_frequency_hz = 2, torque_mean_nm = 2, sampling_rate_hz = 8192, samples_per_period = 8192}"
CRACK = "rig.driver.crack={tooth = 7, stiffness_loss = 0.35}"


def errors(teeth: int = 62, first: str = "1.0") -> str:
    return "rig.driven.pitch_error_um=[" + ", ".join([first] + ["-0.5"] * (teeth - 1)) + "]"


def changed(*settings: str) -> Case:
    return read_case(REFERENCE, settings)


def refusal(*settings: str) -> str:
    with pytest.raises(CaseError) as caught:
        changed(*settings)
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


@pytest.mark.parametrize(
    ("setting", "read", "value"),
    [
        (errors(), lambda rig: rig.driven.pitch_error[:3], (1e-6, -0.5e-6, -0.5e-6)),
        ("rig.driver.runout_um=12.3", lambda rig: rig.driver.runout, 12.3e-6),
        ("rig.driver.runout_phase_deg=90", lambda rig: rig.driver.runout_phase, pi / 2),
        (CRACK, lambda rig: (rig.driver.crack.tooth, rig.driver.crack.stiffness_loss), (7, 0.35)),
        (SLIT, lambda rig: (rig.driver.crack.length, rig.driver.crack.direction), (0.8e-3, 1.0471975511965979)),
        (SLIT, lambda rig: rig.driver.crack.start, 0.5235987755982989),
        ("rig.support.driven.exponent=0.35", lambda rig: rig.support.driven.exponent, 0.35),
        ("rig.support.reference_deflection_um=4.7", lambda rig: rig.support.driver.reference_deflection, 4.7e-6),
        (COUPLING, lambda rig: tuple(rig.drive.coupling.model_dump().values()), (2e-3, 5e4, 1.5)),
        (RIPPLE, lambda rig: tuple(rig.drive.ripple.model_dump().values()), ((6, 12), (0.6, 0.3), (0.0, pi / 2))),
        (SHAFT, lambda rig: tuple(rig.load.coupling.model_dump().values()), (0.02, 4e4, 2.0)),
        (ACROSS, lambda rig: tuple(rig.support.driven.across.model_dump().values()), (2e7, 300.0, -3e6)),
        (ACROSS.replace(".driven", ""), lambda rig: rig.support.driver.across.coupling, -3e6),
        (
            HOUSING,
            lambda rig: tuple(rig.housing.model_dump().values()),
            (40.0, 1e9, 2e3, 1.0, 1.0, 0.0, 0.0, 0.0, None),
        ),
        ("rig.mesh.shared_compliance_um_per_kn=-0.4", lambda rig: rig.mesh.shared_compliance, -0.4e-9),
        ("rig.mesh.end_compliance_um_per_kn=0.7", lambda rig: rig.mesh.end_compliance, 0.7e-9),
        ("rig.mesh.tilt_compliance_um_per_kn=-0.2", lambda rig: rig.mesh.tilt_compliance, -0.2e-9),
        ("rig.mesh.stiffness_drift=-0.004", lambda rig: rig.mesh.stiffness_drift, -0.004),
        ("rig.sensors.encoder_runout_driven_urad=20.1", lambda rig: rig.sensors.encoder_runout_driven, 20.1e-6),
        ("rig.sensors.encoder_runout_driver_phase_deg=90", lambda rig: rig.sensors.encoder_runout_driver_phase, pi / 2),
        ("rig.sensors.filter_hz=4000", lambda rig: rig.sensors.filter, 4000.0),
        ("rig.sensors.gain_torque_driver=1.02", lambda rig: rig.sensors.gain_torque_driver, 1.02),
        ("rig.sensors.quantisation_angle_urad=0.3", lambda rig: rig.sensors.quantisation_angle, 0.3e-6),
        ("rig.sensors.quantisation_displacement_um=0.01", lambda rig: rig.sensors.quantisation_displacement, 0.01e-6),
        ("rig.sensors.quantisation_torque_nm=0.01", lambda rig: rig.sensors.quantisation_torque, 0.01),
        ("rig.friction.coefficient=0.06", lambda rig: rig.friction.coefficient, 0.06),
        ("rig.friction.transition_speed_m_per_s=0.01", lambda rig: rig.friction.transition_speed, 0.01),
        ("rig.mesh.error_mean_um=-3.1", lambda rig: rig.mesh.error_mean, -3.1e-6),
        ("rig.sensors.delay_y_driver_us=-49.9", lambda rig: rig.sensors.delay_y_driver, -49.9e-6),
        ("rig.sensors.noise_angle_urad=1.1", lambda rig: rig.sensors.noise_angle, 1.1e-6),
        ("rig.sensors.noise_displacement_um=0.05", lambda rig: rig.sensors.noise_displacement, 0.05e-6),
        ("rig.sensors.noise_torque_nm=0.02", lambda rig: rig.sensors.noise_torque, 0.02),
    ],
)
def test_keys_are_read_in_their_unit(setting: str, read: Callable[[Rig], Any], value: Any) -> None:
    # Exact: a decimal in its unit becomes the float nearest to it in SI.
    assert read(changed(setting).rig) == value


def test_a_rig_without_effects_has_none() -> None:
    rig = changed().rig
    assert effects_in(rig) == ()
    assert (rig.driver.crack, rig.drive.coupling, rig.drive.ripple, rig.driver.pitch_error) == (None, None, None, ())


@pytest.mark.parametrize(
    ("settings", "keys"),
    [
        ((errors(),), ("rig.driven.pitch_error_um",)),
        (("rig.driver.runout_um=10",), ("rig.driver.runout_um",)),
        ((CRACK,), ("rig.driver.crack",)),
        ((SLIT,), ("rig.driver.crack.length_mm",)),
        (("rig.support.exponent=-0.2",), ("rig.support.driver.exponent", "rig.support.driven.exponent")),
        ((COUPLING,), ("rig.drive.coupling",)),
        ((RIPPLE,), ("rig.drive.ripple",)),
        (("rig.friction.coefficient=0.06",), ("rig.friction.coefficient",)),
        (("rig.mesh.stiffness_scale=1.001",), ("rig.mesh.stiffness_scale",)),
        (
            ("rig.mesh.stiffness_cos=[0, 0.1]", "rig.mesh.stiffness_sin=[0, 0]"),
            ("rig.mesh.stiffness_cos",),
        ),
        (("rig.mesh.error_cos_um=[0]", "rig.mesh.error_sin_um=[-2]"), ("rig.mesh.error_sin_um",)),
        (("rig.mesh.error_mean_um=1",), ("rig.mesh.error_mean_um",)),
        (
            ("rig.sensors.noise_torque_nm=0.1", "rig.sensors.delay_torque_driven_us=-1"),
            ("rig.sensors.delay_torque_driven_us", "rig.sensors.noise_torque_nm"),
        ),
        ((ACROSS,), ("rig.support.driven.across",)),
        ((HOUSING,), ("rig.housing",)),
        ((SHAFT,), ("rig.load.coupling",)),
        (("rig.load.boundary=torque", "rig.load.coupling={inertia_kg_m2 = 0.1}"), ("rig.load.coupling",)),
        ((FREE,), ("rig.load.boundary",)),
        ((CONSTANT, "rig.drive.boundary=inertia"), ("rig.drive.boundary",)),
        ((CONSTANT, "rig.load.boundary=torque", "rig.drive.boundary=speed"), ("rig.drive.boundary",)),
        (("rig.mesh.shared_compliance_um_per_kn=0.1",), ("rig.mesh.shared_compliance_um_per_kn",)),
        (("rig.mesh.end_compliance_um_per_kn=-0.1",), ("rig.mesh.end_compliance_um_per_kn",)),
        (("rig.mesh.tilt_compliance_um_per_kn=0.1",), ("rig.mesh.tilt_compliance_um_per_kn",)),
        (("rig.mesh.stiffness_drift=0.001",), ("rig.mesh.stiffness_drift",)),
        (
            ("rig.sensors.gain_torque_driven=0.99", "rig.sensors.filter_hz=1e3"),
            ("rig.sensors.filter_hz", "rig.sensors.gain_torque_driven"),
        ),
        (("rig.sensors.quantisation_torque_nm=0.1",), ("rig.sensors.quantisation_torque_nm",)),
        (("rig.sensors.encoder_runout_driver_urad=1",), ("rig.sensors.encoder_runout_driver_urad",)),
        # Neutral: nothing but shapes, zeros, and what belongs to the geometry.
        (("rig.sensors.encoder_runout_driver_phase_deg=10", "rig.sensors.gain_torque_driver=1"), ()),
        # A rigid shaft to an end that turns steadily, whatever its inertia; without inertia it is nothing at all.
        (("rig.load.coupling={inertia_kg_m2 = 0.1}",), ()),
        (("rig.load.boundary=torque", "rig.load.coupling={}"), ()),
        (("rig.driver.runout_phase_deg=40", "rig.friction.transition_speed_m_per_s=1"), ()),
        (("rig.support.reference_deflection_um=1",), ()),
        (("rig.driver.thinning_um=30", "rig.driver.crack={tooth = 1, stiffness_loss = 0}"), ()),
        (("rig.driver.crack={tooth = 1, length_mm = 0, direction_deg = 60}",), ()),
        (("rig.drive.ripple={orders = [6], amplitude_nm = [0], phase_deg = [30]}",), ()),
        (("rig.driver.pitch_error_um=[" + "0, " * 61 + "0.0]", "rig.mesh.error_cos_um=[]"), ()),
        (("rig.mesh.stiffness_scale={value = 1, sd = 0.06}",), ()),
    ],
)
def test_the_effects_of_a_rig_are_named_by_their_keys(settings: tuple[str, ...], keys: tuple[str, ...]) -> None:
    assert effects_in(changed(*settings).rig) == keys


def test_a_sound_gear_has_no_errors_and_the_same_geometry() -> None:
    rig = changed(errors(), "rig.driven.runout_um=10", "rig.driven.runout_phase_deg=10", "rig.driven.profile_shift=0.1")
    sound = sound_gear(changed(CRACK).rig.driver)
    assert sound == changed().rig.driver
    assert sound_gear(rig.rig.driven) == changed("rig.driven.profile_shift=0.1").rig.driven


def test_optional_tables_stay_absent_when_written(tmp_path: Path) -> None:
    plain = dump_case(changed())
    for table in ("coupling]", "ripple", "crack", "across", "housing"):
        assert table not in plain
    structure = (ACROSS, HOUSING, SHAFT, "rig.sensors.filter_hz=2e3")
    spread = "rig.drive.coupling.inertia_kg_m2={value = 2e-3, sd = 4e-5}"
    full = changed(errors(), CRACK, COUPLING, RIPPLE, *structure, spread)
    copy = tmp_path / "copy.toml"
    copy.write_text(dump_case(full), encoding="utf-8")
    assert read_case(copy) == full
    assert full.uncertainty == {"rig.drive.coupling.inertia": 4e-5}


def test_the_reference_file_shows_valid_optional_tables(tmp_path: Path) -> None:
    lines, inside = [], False
    for line in REFERENCE.read_text(encoding="utf-8").splitlines():
        inside = bool(re.fullmatch(r"# \[rig[a-z.]+\]", line)) or (inside and line.startswith("# "))
        lines.append(line.removeprefix("# ") if inside else line)
    full = tmp_path / "full.toml"
    full.write_text("\n".join(lines), encoding="utf-8")
    wanted = (
        *("rig.driver.crack.length_mm", "rig.driven.crack.length_mm"),
        *("rig.support.driver.across", "rig.support.driven.across", "rig.housing"),
        *("rig.drive.coupling", "rig.drive.ripple", "rig.load.coupling"),
    )
    assert effects_in(read_case(full).rig) == wanted


def test_standard_deviations_of_new_numbers() -> None:
    case = changed(
        "rig.mesh.stiffness_scale={value = 1, sd = 0.06}",
        "rig.damping.mesh_ratio={value = 0.05, sd = 0.02}",
        "rig.support.exponent={value = 0.1, sd = 0.2}",
        "rig.support.reference_deflection_um={value = 10, sd = 3}",
        errors(first="{value = 1, sd = 0.25}"),
    )
    assert case.uncertainty == {
        "rig.mesh.stiffness_scale": 0.06,
        "rig.damping.mesh_ratio": 0.02,
        "rig.support.driver.exponent": 0.2,
        "rig.support.driven.exponent": 0.2,
        "rig.support.driver.reference_deflection": 3e-6,
        "rig.support.driven.reference_deflection": 3e-6,
        "rig.driven.pitch_error.0": 0.25e-6,
    }


def test_a_gear_with_its_own_support_across_keeps_none_of_the_common_one() -> None:
    common = "rig.support.across={stiffness_n_per_m = {value = 2e7, sd = 1e6}, damping_n_s_per_m = 5}"
    own = "rig.support.driver.across={stiffness_n_per_m = 1e7}"
    case = changed(common, own)
    assert case.rig.support.driver.across.model_dump() == {"stiffness": 1e7, "damping": 0.0, "coupling": 0.0}
    assert case.rig.support.driven.across.damping == 5.0
    assert case.uncertainty == {"rig.support.driven.across.stiffness": 1e6}


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        (errors(61), ["rig.driven", "pitch_error_um has 61 values", "none or 62"]),
        (errors(first="nan"), ["rig.driven.pitch_error_um[0] = nan", "finite"]),
        (errors(first="1e400"), ["rig.driven.pitch_error_um[0]", "finite"]),
        (errors(first="'a'"), ["rig.driven.pitch_error_um[0]", "number in um"]),
        (errors(first="1001"), ["pitch_error_um[0] = 1001", "-1000 and 1000"]),
        ("rig.driver.pitch_error_um=3", ["rig.driver.pitch_error_um = 3", "list"]),
        ("rig.driver.pitch_eror_um=[]", ["rig.driver.pitch_eror_um", "did you mean pitch_error_um?"]),
        ("rig.driver.runout=1", ["rig.driver.runout ", "spelt runout_um"]),
        ("rig.driver.runout_um=-1", ["rig.driver.runout_um = -1", "at least 0 um"]),
        ("rig.driver.crack={tooth = 62, stiffness_loss = 0.1}", ["rig.driver", "crack.tooth = 62", "teeth = 62"]),
        ("rig.driver.crack={tooth = -1, stiffness_loss = 0.1}", ["rig.driver.crack.tooth = -1", "at least 0"]),
        ("rig.driver.crack={tooth = 1.5, stiffness_loss = 0.1}", ["rig.driver.crack.tooth = 1.5", "whole number"]),
        ("rig.driver.crack={tooth = 1, stiffness_loss = 0.96}", ["stiffness_loss = 0.96", "at most 0.95"]),
        (SLIT.replace("direction_deg = 60", "stiffness_loss = 0.1"), ["direction_deg is missing", "length_mm"]),
        (SLIT.replace("length_mm = 0.8, ", ""), ["length_mm is missing", "direction_deg is given"]),
        (SLIT.replace("}", ", stiffness_loss = 0.1}"), ["stiffness_loss = 0.1", "length_mm = 0.8", "one of them"]),
        (SLIT.replace("= 60", "= 151"), ["rig.driver.crack.direction_deg = 151", "at most 150"]),
        (SLIT.replace("= 60", "= 60, start_deg = -1"), ["rig.driver.crack.start_deg = -1", "at least 0"]),
        (SLIT.replace("tooth = 7", "tooth = 62"), ["crack.tooth = 62", "teeth = 62"]),
        ("rig.driver.crack={tooth = 1}", ["rig.driver.crack", "stiffness_loss is missing", "length_mm"]),
        ("rig.support.exponent=-0.9", ["rig.support.exponent = -0.9", "greater than -0.9"]),
        ("rig.support.driver.exponent=3.1", ["rig.support.driver.exponent = 3.1", "at most 3"]),
        ("rig.drive.coupling={stiffness_nm_per_rad = 1}", ["rig.drive.coupling.inertia_kg_m2 is missing"]),
        (
            "rig.drive.coupling={inertia_kg_m2 = 1, damping_nm_s_per_rad = 2}",
            ["rig.drive.coupling", "damping_nm_s_per_rad = 2", "stiffness_nm_per_rad is absent"],
        ),
        (
            "rig.drive.ripple={orders = [6], amplitude_nm = [1, 2], phase_deg = [0]}",
            ["rig.drive.ripple", "orders has 1", "amplitude_nm has 2", "equally many"],
        ),
        (
            "rig.drive.ripple={orders = [0], amplitude_nm = [1], phase_deg = [0]}",
            ["rig.drive.ripple", "orders[0] = 0", "between 1 and"],
        ),
        (
            "rig.drive.ripple={orders = [6, 6], amplitude_nm = [1, 1], phase_deg = [0, 0]}",
            ["rig.drive.ripple", "orders = [6, 6]", "once"],
        ),
        (
            "rig.drive.ripple={orders = [6.5], amplitude_nm = [1], phase_deg = [0]}",
            ["rig.drive.ripple.orders[0] = 6.5", "whole number"],
        ),
        (SHAFT.replace("0.02", "-1"), ["rig.load.coupling.inertia_kg_m2 = -1", "at least 0"]),
        ("rig.load={boundary = 'torque', coupling = {stiffness_nm_per_rad = 1}}", ["rig.load", "inertia_kg_m2 = 0"]),
        ("rig.drive.boundary=speed", ["drive.boundary", "load.boundary", "no torque"]),
        ("rig.drive.boundary=inertia", ["the experiment has a multisine", 'rig.drive.boundary = "inertia"']),
        ("rig.drive.boundary=torqe", ["rig.drive.boundary", 'did you mean "torque"?']),
        (ACROSS.replace("-3e6", "1.2e7"), ["rig.support.driven", "across.coupling_n_per_m = 12000000", "1.09545e+07"]),
        (ACROSS.replace("stiffness_n_per_m = 2e7, ", ""), ["rig.support.driven.across.stiffness_n_per_m is missing"]),
        (
            HOUSING.replace("40", "40, driver_share_across = 0.4"),
            ["housing.driver_share_across moves", "support.driver.across"],
        ),
        (HOUSING.replace("40", "0"), ["rig.housing.mass_kg = 0", "greater than 0 kg"]),
        (HOUSING.replace("mass_kg = 40, ", ""), ["rig.housing.mass_kg is missing"]),
        ("rig.mesh.stiffness_drift=-1", ["rig.mesh.stiffness_drift = -1", "greater than -1"]),
        ("rig.sensors.filter_hz=0", ["rig.sensors.filter_hz = 0", "greater than 0 Hz"]),
        ("rig.sensors.gain_torque_driver=0", ["gain_torque_driver = 0", "greater than 0"]),
        ("rig.sensors.quantisation_angle_urad=-1", ["quantisation_angle_urad = -1", "at least 0 urad"]),
        ("rig.sensors.encoder_runout_driver_urad=20000", ["encoder_runout_driver_urad = 20000", "at most 10000"]),
        ("rig.friction.coefficient=1.1", ["rig.friction.coefficient = 1.1", "at most 1"]),
        ("rig.friction.transition_speed_m_per_s=0", ["transition_speed_m_per_s = 0", "greater than 0 m/s"]),
        ("rig.mesh.stiffness_scale=0", ["rig.mesh.stiffness_scale = 0", "greater than 0"]),
        ("rig.mesh.stiffness_cos=[0.1]", ["rig.mesh", "stiffness_cos has 1", "stiffness_sin has 0"]),
        ("rig.mesh={stiffness_cos=[0.6, 0.3], stiffness_sin=[0.8, 0]}", ["rig.mesh", "add up to 1.3", "less than 1"]),
        ("rig.sensors.delay_y_driver_us=100001", ["delay_y_driver_us = 100001", "at most 100000 us"]),
        ("rig.sensors.noise_angle_urad=-1", ["rig.sensors.noise_angle_urad = -1", "at least 0 urad"]),
        ("experiment.multisine.grid=cmob", ["experiment.multisine.grid", 'did you mean "comb"?']),
        ("experiment.multisine.residue=7", ["experiment.multisine", "residue = 7", 'grid = "full"']),
        ("experiment.multisine.residue=0", ["experiment.multisine.residue = 0", "at least 1"]),
    ],
)
def test_bad_effects_are_refused_in_one_sentence(setting: str, words: list[str]) -> None:
    sentence = refusal(setting)
    for word in words:
        assert word in sentence, sentence
