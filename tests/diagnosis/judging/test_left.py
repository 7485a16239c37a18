"""What a judged record tells is left of the gap, by which rig and on which way, on signals made by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shared.fake_simulator import LINES, target

from gearbench.diagnosis.effects.effect import Hypothesis, Wide
from gearbench.diagnosis.judging import closing as closing_module
from gearbench.diagnosis.judging import judged as judged_module
from gearbench.diagnosis.judging.closing import Closing, rms_closed
from gearbench.diagnosis.judging.judged import Judged, Sizes

FRICTION = Hypothesis("friction", "mesh", (Wide("friction"),))


def test_parts_of_the_gap_are_energies_beyond_noise_in_units_of_each_channel(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    measured = {name: size * rng.standard_normal((1, 4096)) for name, size in (("dte", 1.0), ("y_driver", 10.0))}
    for where in (judged_module, closing_module):
        monkeypatch.setattr(where, "measured_channels", lambda one: measured)
    gap = {name: values[0] - values[0].std() * rng.standard_normal(4096) for name, values in measured.items()}
    nominal = {name: values[0] - 0.5 * gap[name] for name, values in measured.items()}
    final = {name: values[0] - 0.1 * gap[name] for name, values in measured.items()}
    half = {**final, "dte": measured["dte"][0] - 0.4 * gap["dte"]}
    made = Judged(None, None, {}, nominal, nominal, final)  # type: ignore[arg-type]
    assert isinstance(made.sizes["dte"], Sizes)
    assert made.left == pytest.approx(0.1 / 0.5)
    assert made.remains == pytest.approx(0.1 * np.sqrt(2), rel=0.05)
    assert made.share(nominal) == pytest.approx(1 - 0.2**2)
    assert made.share(half) == pytest.approx(0.5 * (0.4**2 - 0.1**2) / 0.5**2, rel=0.05)
    assert made.share(final) == 0.0
    closing = Closing(9.0, 2.0, ("dte", "excited"), half)
    assert replace(made, closings={"friction": closing}).share_of(FRICTION) == made.share(half)
    assert made.grown(half) == pytest.approx(np.sqrt((0.4**2 + 0.1**2) / (2 * 0.1**2)), rel=0.05)
    assert made.grown(final) == 1.0
    whole = replace(made, signals={name: values[0] for name, values in measured.items()})
    assert whole.left == 0.0 and whole.grown(half) > 1e6
    value, low, high = rms_closed(None, "dte", half["dte"], final["dte"])  # type: ignore[arg-type]
    assert low < value < high < 1.1 * value and value == pytest.approx(np.sqrt(0.15) * gap["dte"].std(), rel=1e-6)
    # Up to the line where the excitation ends, as all sizes are told.
    half_band, _, _ = rms_closed(None, "dte", half["dte"], final["dte"], 1024)  # type: ignore[arg-type]
    assert half_band == pytest.approx(np.sqrt(0.5) * value, rel=0.05)


def test_a_rig_strays_whose_gap_is_that_of_another_way(monkeypatch: pytest.MonkeyPatch) -> None:
    wave = np.cos(2 * np.pi * np.arange(64)[:, None] * np.arange(4) / 64)
    mean = 3.0 * wave[:, 1]
    monkeypatch.setattr(judged_module, "measured_channels", lambda one: {"dte": mean[None]})
    nominal, off, kept = ({"dte": mean - size * wave[:, 2]} for size in (2.0, 1.0, 0.2))
    noise = {"dte": 0.1 * wave[:, 3]}
    made = Judged(SimpleNamespace(name="heavy"), None, {}, nominal, nominal, off, noise=noise)  # type: ignore[arg-type]
    assert made.along is None and made.left == pytest.approx(np.sqrt(0.99 / 3.99))
    assert made.strays_from(kept) and not made.strays_from({"dte": mean - 0.3 * wave[:, 2]})
    # Within twice the noise nothing does.
    assert not replace(made, noise={"dte": 0.6 * wave[:, 3]}).strays_from(kept)
    there = replace(made, kept=kept)
    assert there.along is not None and there.along[1:] == pytest.approx((0.2 / np.sqrt(2), 1 / np.sqrt(2)))
    # What is missing is missing along the record's way; the gap is that of the rig by itself.
    assert there.left == pytest.approx(np.sqrt(0.03 / 3.99)) and there.sizes["dte"].final == pytest.approx(np.sqrt(0.5))
    assert there.remains == pytest.approx(np.sqrt(0.03) / 3.0)
    assert there.share(off) == pytest.approx((1.0 - 0.04) / 3.99) and made.share(off) == 0.0


def test_a_rig_is_astray_that_is_further_off_than_that_without_any_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    wave = np.cos(2 * np.pi * np.arange(64)[:, None] * np.arange(3) / 64)
    mean = 3.0 * wave[:, 1]
    monkeypatch.setattr(judged_module, "measured_channels", lambda one: {"dte": mean[None]})
    nominal, plain, near, far = ({"dte": mean - size * wave[:, 2]} for size in (2.0, 0.4, 0.59, 0.61))
    made = [Judged(None, None, {}, nominal, plain, final) for final in (plain, near, far)]  # type: ignore[arg-type]
    assert [one.is_astray for one in made] == [False, False, True]
    # A rig that goes another way than the record is judged along the record's.
    assert not replace(made[2], kept=near).is_astray


def test_beyond_the_lines_of_the_search_nothing_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """A resonance above the excitation is no part of the gap, nor of what a channel fluctuates by."""
    wave = np.exp(2j * np.pi * np.arange(64)[:, None] * np.arange(32) / 64).real
    mean = 3.0 + 2.0 * wave[:, 4] + wave[:, 20]
    monkeypatch.setattr(judged_module, "measured_channels", lambda one: {"dte": mean[None]})
    made = Judged(
        None,  # type: ignore[arg-type]
        None,  # type: ignore[arg-type]
        {},
        {"dte": 0.0 * mean},
        {"dte": mean - wave[:, 5]},
        {"dte": mean - 0.2 * wave[:, 5] - wave[:, 20] - 1.0},
        target=replace(target(np.zeros(LINES)), plan=((0, "dte", np.arange(1, 9)),)),
        noise={"dte": np.stack([0.1 * wave[:, 3], 0.1 * wave[:, 6], wave[:, 30]], axis=0)},
    )
    sizes = made.sizes["dte"]
    assert (sizes.fluctuation, sizes.nominal) == pytest.approx((np.sqrt(2.0), np.sqrt(2.0)))
    assert (sizes.plain, sizes.final, sizes.noise) == pytest.approx((np.sqrt(0.5), 0.2 * np.sqrt(0.5), 0.1))
    assert made.beyond_noise == pytest.approx(2 * np.sqrt(0.5) - 1)
