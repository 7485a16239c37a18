"""Live figures of a study hold the study's numbers, and one choice of the menu shows one group of curves."""

from __future__ import annotations

import json
import re
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from gearbench.bench.study.indices import Effect, Effects
from gearbench.report.study_live import live_scatter, live_tornado

NONE = (np.nan, np.nan)


def figure(page: str) -> dict[str, Any]:
    (held,) = re.findall(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)
    data: dict[str, Any] = json.loads(held.replace("<\\/", "</"))
    return data


def table() -> xr.Dataset:
    """f = 10 a + b over a grid of a, text b; one member failed."""
    pairs = list(product((1.0, 2.0, 3.0), ("x/one.toml", "x/two.toml")))
    value = np.array([10 * a + (b == "x/two.toml") for a, b in pairs])
    value[5] = np.nan
    numbers = np.array([a for a, _ in pairs])
    texts = np.array([b for _, b in pairs], dtype=object)
    return xr.Dataset({
        "rig.driver.a+rig.driven.a": ("member", numbers, {"units": "mm"}),
        "rig.driver": ("member", texts, {"units": ""}),
        "f_um": ("member", value, {"units": "um", "long_name": "f"}),
        "g": ("member", 2 * value, {"units": "1", "long_name": "g"}),
    })  # fmt: skip


def test_scatter_holds_every_member_and_the_mean_of_each_level() -> None:
    held = table()
    data = figure(live_scatter(held, ["rig.driver.a+rig.driven.a", "rig.driver"], ["f_um", "g"], "", "words"))
    traces = data["traces"]
    assert len(traces) == 2 * 4
    assert traces[0]["x"] == [1, 1, 2, 2, 3, 3] and traces[0]["y"] == [10, 11, 20, 21, 30, None]
    assert (traces[1]["x"], traces[1]["y"]) == ([1, 2, 3], [10.5, 20.5, 30])
    assert traces[2]["x"] == ["one.toml", "two.toml"] * 3 and traces[3]["x"] == []
    assert traces[4]["y"] == [20, 22, 40, 42, 60, None]
    (menu,) = data["layout"]["updatemenus"]
    assert [one["label"] for one in menu["buttons"]] == [
        "f_um over a ..", "f_um over driver", "g over a ..", "g over driver",
    ]  # fmt: skip
    for number, one in enumerate(menu["buttons"]):
        shown = [place for place, seen in enumerate(one["args"][0]["visible"]) if seen]
        assert shown == [2 * number, 2 * number + 1]
    assert [trace["visible"] for trace in traces] == [True, True] + 6 * [False]


def test_tornado_ranks_factors_by_their_range() -> None:
    small = Effect("rig.driver.b_mm", 5.0, 4.0, 4.0, 5.0, 0.1, NONE, np.nan, NONE, 0.0)
    large = Effect("rig.driver.a_mm", 1.0, 8.0, 1.0, 9.0, 0.9, NONE, 0.95, NONE, 0.0)
    data = figure(live_tornado([Effects("f_um", "um", "a grid", 6, (small, large))], "", "words"))
    bar, low, high = data["traces"]
    assert bar["y"] == ["driver.<br>a_mm", "driver.<br>b_mm"]
    assert (bar["base"], bar["x"]) == ([1, 4], [8, 1])
    assert (low["x"], high["x"]) == ([1, 5], [8, 4])
    assert bar["text"] == ["S 0.90, T 0.95", "S 0.10, T unknown"]
    assert data["layout"]["yaxis"]["categoryarray"] == bar["y"][::-1]
    assert "updatemenus" not in data["layout"]
