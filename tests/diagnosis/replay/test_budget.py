"""The gap budget against gaps whose place is known by construction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import acos, cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from shared.measured import MESH, RATE, SAMPLES, channels, nominal, record

from gearbench.diagnosis.errors import DiagnosisError
from gearbench.diagnosis.intake.measurements import Measurement, measurement
from gearbench.diagnosis.intake.signals import measured_channels, simulated_channels
from gearbench.diagnosis.replay.budget import budget, contact_zones, line_classes
from gearbench.diagnosis.verdict import Share
from gearbench.geometry import pair

Channels = dict[str, np.ndarray]
TIME = np.arange(SAMPLES) / RATE
MESHING = pair(nominal().rig)


def measured(noise: float = 0.0, **changes: float) -> Measurement:
    """The shared record with excitation on the lines 31, 91 and 151: a comb of residue 29 modulo 60."""
    return measurement(record(channels(noise=noise, **changes)), "base", nominal())


def simulated(one: Measurement, **gaps: np.ndarray | float) -> Channels:
    """What was measured less the given gaps (N,) by channel."""
    mean = {name: rows.mean(axis=0) for name, rows in measured_channels(one).items()}
    return {name: values - gaps.get(name, 0.0) for name, values in mean.items()}


def shares(found: tuple[Share, ...], kind: str) -> dict[str, float]:
    return {one.name: one.share for one in found if one.kind == kind}


def tone(line: int, size: float = 1e-6) -> np.ndarray:
    return size * np.cos(2 * pi * line * RATE / SAMPLES * TIME + 0.3)


KINDS = {"channel", "band", "class", "phase", "tooth", "condition"}


@pytest.mark.parametrize("seed", range(3))
def test_every_kind_adds_up_to_one(seed: int) -> None:
    draw = np.random.default_rng(seed)
    one, two = measured(noise=1.0), replace(measured(noise=1.0, seed=1), name="light")
    names = ("dte", "y_driver", "y_driven", "torque_driven")
    # All lines up to the last one, and a mean, which is not in the budget.
    parts = [{name: draw.normal(size=SAMPLES) * 10.0 ** draw.integers(-7, 1) + 3.0 for name in names} for _ in range(2)]
    replays = [simulated(case, **part) for case, part in zip((one, two), parts, strict=True)]
    variants = [[{name: value + 1e-7 * tone(7) for name, value in replay.items()} for replay in replays]]
    found = budget([one, two], replays, nominal(), variants)
    assert {share.kind for share in found} == KINDS
    for kind in KINDS:
        assert sum(shares(found, kind).values()) == pytest.approx(1.0, abs=1e-12), kind
        for floor in ("floor", "floor_noise", "floor_nominal"):
            totals = [sum(getattr(one, floor) for one in found if one.kind == k) for k in (kind, "channel")]
            assert totals[0] == pytest.approx(totals[1], rel=1e-9), (kind, floor)


@pytest.mark.parametrize(
    ("line", "band", "kind"),
    [
        (31, "0-100 Hz", "excited"),
        (60, "0-100 Hz", "operating"),
        (480, "100-500 Hz", "operating"),
        (120, "0-100 Hz", "operating"),  # 100 Hz: the edge belongs to the lower band
        (2 * 31 + 600, "500-1500 Hz", "even"),
        (9 * 60 + 3, "100-500 Hz", "driver-shaft"),
        (9 * 60 + 4, "100-500 Hz", "driven-shaft"),
        (2400, "above 1500 Hz", "operating"),
        (2417, "above 1500 Hz", "other"),
    ],
)
def test_a_tone_is_found(line: int, band: str, kind: str) -> None:
    excited = sum(30.0 * np.cos(2 * pi * k * RATE / SAMPLES * TIME) for k in (31, 91, 1771))
    values = channels(noise=0.0)
    values["torque_driver"] = 100.0 + np.tile(excited, 2)
    one = measurement(record(values), "base", nominal())
    found = budget([one], [simulated(one, y_driven=tone(line))], nominal())
    assert shares(found, "band")[band] == pytest.approx(1.0)
    assert shares(found, "class")[kind] == pytest.approx(1.0)
    assert shares(found, "channel")["y_driven"] == pytest.approx(1.0)
    assert shares(found, "condition") == {"base": 1.0}


def test_without_a_comb_excited_lines_are_their_own_class() -> None:
    values = channels(noise=0.0)
    lines = (31, 77, 93)
    values["torque_driver"] = 100.0 + np.tile(sum(tone(line, 10.0) for line in lines), 2)
    one = measurement(record(values), "base", nominal())
    names, labels = line_classes(one)
    # 77 and 31 carry no shaft order; Of a shaft's orders three sidebands are named: not 93 = 60 + 11 x 3.
    assert [names[labels[line]] for line in (31, 77, 93, 60, 63, 44)] == [
        "excited", "excited", "excited", "operating", "driver-shaft", "other",
    ]  # fmt: skip


def test_energies_of_conditions_and_channels_are_in_units_of_the_measured_fluctuation() -> None:
    one, two = measured(), replace(measured(torque=75.0), name="light")
    gaps = [{"dte": tone(31, 2e-6), "y_driver": tone(33, 1e-7)}, {"dte": tone(31, 1e-6)}]
    replays = [simulated(case, **gap) for case, gap in zip((one, two), gaps, strict=True)]
    found = budget([one, two], replays, nominal())
    # By hand: energies over mean squares of both records' fluctuations.
    unit = {
        name: np.mean([np.var(measured_channels(case)[name][0]) for case in (one, two)]) for name in ("dte", "y_driver")
    }
    energy = {"dte": (4e-12 + 1e-12) / 2 / unit["dte"], "y_driver": 1e-14 / 2 / unit["y_driver"]}
    whole = sum(energy.values())
    assert shares(found, "channel")["dte"] == pytest.approx(energy["dte"] / whole)
    assert shares(found, "channel")["y_driver"] == pytest.approx(energy["y_driver"] / whole)
    light = 1e-12 / 2 / unit["dte"] / whole
    assert shares(found, "condition") == pytest.approx({"base": 1 - light, "light": light})


def test_a_burst_at_one_tooth_is_found() -> None:
    one = measured()
    nearest = np.floor(one.phase + 0.5).astype(int)
    # A mean-free burst whenever driver tooth 7 is next to the pitch point: with driven teeth 7, 27 and 17.
    burst = np.where(nearest % 20 == 7, 1e-6 * np.sin(2 * pi * 4 * one.phase), 0.0)
    found = shares(budget([one], [simulated(one, dte=burst)], nominal()), "tooth")
    assert len(found) == 50
    assert found["driver 7"] == pytest.approx(0.5)
    assert [found[f"driven {tooth}"] for tooth in (7, 27, 17)] == pytest.approx([1 / 6] * 3, rel=0.02)
    assert found["driver 8"] == pytest.approx(0.0, abs=1e-9)


def test_zones_follow_from_the_contact_ratio() -> None:
    # Closed form (ISO 21771): z 20/30, m 3 mm, 20 degrees, tip edges of 50 um shorten the path a little.
    base = [1.5e-3 * z * cos(radians(20)) for z in (20, 30)]
    tip = [1.5e-3 * z + 3e-3 for z in (20, 30)]
    pitch = 2 * base[0] * pi / 20
    recess, approach = (
        (sqrt(t**2 - b**2) - b * sin(radians(20)) / cos(radians(20))) / pitch for t, b in zip(tip, base, strict=True)
    )
    assert acos(base[0] / (1.5e-3 * 20)) == pytest.approx(radians(20))
    phase = (np.arange(40000) + 0.5) / 40000 + 17
    names, labels = contact_zones(MESHING, phase)
    part = {name: float(np.mean(labels == i)) for i, name in enumerate(names)}
    assert set(part) == {"single", "double", "entry", "exit"}
    ratio = recess + approach
    assert part["double"] == pytest.approx(ratio - 1 - 0.1, abs=0.03)
    assert part["single"] == pytest.approx(2 - ratio - 0.2, abs=0.03)
    assert part["entry"] == pytest.approx(0.15, abs=1e-3) and part["exit"] == pytest.approx(0.15, abs=1e-3)

    def zone(at: float) -> str:
        return names[contact_zones(MESHING, np.array([at]))[1][0]]

    # A pair enters at -approach and leaves at +recess; under load earlier and later.
    assert zone(-approach + 0.02) == "entry" and zone(3 - approach - 0.05) == "entry"
    assert zone(recess - 0.02) == "exit" and zone(5 + recess + 0.05) == "exit"
    assert zone(-approach + 0.12) == "double" and zone(recess + 0.14) == "single" and zone(0.0) == "single"


def test_a_burst_in_double_contact_is_found() -> None:
    one = measured()
    inside = np.abs((one.phase + 0.5) % 1.0 - 0.0) < 0.05  # half a pitch after the pitch point: two pairs
    burst = np.where(inside, 1e-6, 0.0) * np.where(np.arange(SAMPLES) % 2, 1, -1)
    found = shares(budget([one], [simulated(one, dte=burst)], nominal()), "phase")
    assert found["double"] == pytest.approx(1.0, abs=1e-3)


def test_noise_is_the_whole_of_a_perfect_model() -> None:
    ratios = []
    for seed in range(4):
        one = measured(noise=1.0, seed=seed)
        clean = measured(noise=0.0, seed=seed)
        found = budget([one], [simulated(clean)], nominal())
        for kind in ("channel", "band"):
            for share in (s for s in found if s.kind == kind):
                assert share.floor_noise is not None and share.floor is None and share.floor_nominal is None
                assert share.floor_noise == pytest.approx(share.share, rel=0.3, abs=0.01), share
        ratios.append(sum(s.floor_noise or 0.0 for s in found if s.kind == "channel"))
    # 4 channels of 12 288 samples each: 1 % per record.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.02)


def test_one_row_has_no_noise_floor() -> None:
    one = measurement(record(channels(periods=1), periods=1), "base", nominal())
    replay = simulated(one, dte=tone(31))
    found = budget([one], [replay], nominal(), [[replay]])
    assert all(share.floor is None and share.floor_noise is None for share in found)
    assert all(share.floor_nominal == 0.0 for share in found)
    # Nor has a set in which only some records tell their noise.
    two = replace(measured(), name="light")
    mixed = budget([one, two], [replay, simulated(two)], nominal())
    assert all(share.floor_noise is None for share in mixed)


def test_the_nominal_floor_adds_the_energies_of_single_parameters() -> None:
    one = measured()
    replay = simulated(one, dte=tone(31, 2e-6))
    moved = [[{**replay, "dte": replay["dte"] + tone(line, size)}] for line, size in ((31, 1e-6), (60, -1e-6))]
    found = budget([one], [replay], nominal(), moved)
    floors = {(s.kind, s.name): s.floor_nominal for s in found}
    assert floors["class", "excited"] == pytest.approx(0.25)
    assert floors["class", "operating"] == pytest.approx(0.25)
    assert floors["channel", "dte"] == pytest.approx(0.5)
    assert next(s for s in found if s.kind == "channel").floor == pytest.approx(0.5)


def test_means_are_not_in_the_budget() -> None:
    one = measured()
    plain = budget([one], [simulated(one, dte=tone(31))], nominal())
    shifted = budget([one], [simulated(one, dte=tone(31) + 5e-6, y_driver=1e-5)], nominal())
    assert [s.share for s in shifted] == pytest.approx([s.share for s in plain], abs=1e-12)


def test_arbitrary_phase_has_no_teeth_and_no_zones() -> None:
    values = {name: value for name, value in channels(noise=0.0).items() if name != "mesh_phase"}
    one = measurement(record(values, mesh_phase_origin="arbitrary"), "base", nominal())
    found = budget([one], [simulated(one, dte=tone(31))], nominal())
    assert {share.kind for share in found} == KINDS - {"phase", "tooth"}


def test_no_gap_no_budget_and_wrong_counts() -> None:
    one = measured()
    assert budget([one], [simulated(one)], nominal()) == ()
    with pytest.raises(DiagnosisError, match="1 measurements have 2 simulations"):
        budget([one], [simulated(one), simulated(one)], nominal())
    with pytest.raises(DiagnosisError, match="1 measurements have 0 simulations"):
        budget([one], [simulated(one)], nominal(), [[]])


def test_a_replay_is_put_on_equal_terms() -> None:
    # The same record as its own replay: no gap in any channel, whatever its own dte channel says.
    one = measured()
    replay = record({**{k: v[:SAMPLES] for k, v in channels(noise=0.0).items()}, "dte": TIME}, periods=1)
    made: Mapping[str, np.ndarray] = simulated_channels(one, replay)
    rows = measured_channels(one)
    assert set(made) == {"dte", "angle_driver", "angle_driven", "y_driver", "y_driven", "torque_driven"}
    for name, values in made.items():
        assert np.abs(rows[name][0] - values).max() < 1e-12 * max(1.0, np.abs(values).max()), name
    # The DTE in closed form (shared.measured): force over mesh stiffness plus 2 um at the mesh frequency.
    force = channels(noise=0.0)["torque_driver"][:SAMPLES] / MESHING.driver.base_radius
    assert np.abs(made["dte"] - force / 1e8 - 2e-6 * np.cos(2 * pi * MESH * TIME)).max() < 1e-12
    # A driven gear that runs ahead by 1 urad opens the mesh.
    ahead = simulated_channels(one, replay.assign(angle_driven=replay["angle_driven"] + 1e-6))
    assert np.allclose(ahead["dte"] - made["dte"], -1e-6 * MESHING.driven.base_radius, rtol=1e-6)
    with pytest.raises(DiagnosisError, match="has 100 samples; a repetition of it has 12288"):
        simulated_channels(one, replay.isel(time=slice(0, 100)))
