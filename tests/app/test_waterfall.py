"""The waterfall of the gap: its steps, and that it is drawn."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from gearbench.diagnosis.verdict import Effect, Gap, Range
from gearbench.figures.gaps import diagnosis_waterfall as module
from gearbench.figures.gaps.diagnosis_waterfall import draw_waterfall, steps_of


def about(value: float) -> Range:
    return Range(value=value, low=value, high=value)


def gap(with_effect: float | None) -> Gap:
    return Gap(
        record="r", channel="dte", band_hz=(0.0, 3000.0), unit="m", nominal=about(13e-6), recalibrated=about(5e-6),
        with_effect=None if with_effect is None else about(with_effect), floor=about(1e-6),
    )  # fmt: skip


def effect(name: str, closes: float) -> Effect:
    return Effect(name=name, probability=0.9, closes={"dte": about(closes)})


def test_each_step_leaves_what_the_later_ones_take_off() -> None:
    # By energy 5^2 = 3^2 + 4^2: with coupling and friction 3 um are left, and friction alone takes 4 of the rest off.
    rows = steps_of(gap(3e-6), (effect("friction", 2.0), effect("coupling", 3.4641016)))
    assert [one.words for one in rows] == [
        "nominal rig", "recalibrated", "+ another stiffness of the coupling", "+ friction between the flanks",
        "noise floor",
    ]  # fmt: skip
    assert [one.left for one in rows] == pytest.approx([13.0, 5.0, 13**0.5, 3.0, 1.0])
    assert [one.words for one in steps_of(gap(None), ())] == ["nominal rig", "recalibrated", "noise floor"]


def test_no_step_is_drawn_above_the_one_before() -> None:
    rows = steps_of(gap(3e-6), (effect("friction", 9.0), effect("coupling", 8.0)))
    assert [one.left for one in rows] == pytest.approx([13.0, 5.0, 5.0, 3.0, 1.0])


def test_what_comes_back_without_an_effect_is_told_where_the_recalibrated_rig_hid_it() -> None:
    """By energy 12^2 + 3^2 come back of a rig that is at 5 without any effect; 4^2 + 3^2 = 5^2 is that step itself."""
    rows = steps_of(gap(3e-6), (effect("friction", 4.0),))
    assert [one.without for one in rows] == [None] * 4
    rows = steps_of(gap(3e-6), (effect("friction", 12.0),))
    assert rows[2].without == pytest.approx(153**0.5) and rows[2].left == pytest.approx(3.0)


def test_it_is_a_picture(tmp_path: Path) -> None:
    draw_waterfall(tmp_path / "w.svg", (gap(3e-6),), (effect("friction", 4.0),), "held-out")
    words = (tmp_path / "w.svg").read_text(encoding="utf-8")
    assert "+ friction between the flanks" in words and "record held-out [um]" in words
    assert "without it" not in words
    draw_waterfall(tmp_path / "x.svg", (gap(3e-6),), (effect("friction", 12.0),), "held-out")
    assert "3.00; 12.4 without it" in (tmp_path / "x.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["friction", "bearing-nonlinearity"])
def test_what_is_told_beside_a_bar_is_in_the_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """However long the words before the axis are."""
    kept: list[Figure] = []
    monkeypatch.setattr(module, "save", lambda drawing, path: kept.append(drawing))
    draw_waterfall(tmp_path / "w.png", (gap(3e-6),), (effect(name, 40.0),), "held-out")
    (drawing,) = kept
    drawing.draw_without_rendering()
    (axes,) = drawing.axes
    told = [one for one in axes.texts if one.get_text()]
    assert len(told) == 4 and "3.00; 40.1 without it" in [one.get_text() for one in told]
    ends = [one.get_window_extent().x1 / axes.get_window_extent().x1 for one in told]
    assert 0.95 < max(ends) <= 1.0
