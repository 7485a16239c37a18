"""Live figures: one file that fetches nothing, data that plotly accepts and gives back, peaks that survive thinning."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from base64 import b64decode
from typing import Any

import numpy as np
import pytest
from shared.pages import elements, fetched

from gearbench.report.html import text
from gearbench.report.live import Quantity, Sheet, axes, curve, live, live_map, live_page, log_axis, thinned

PHASE, FREQUENCY = np.arange(8) / 8, np.linspace(100.0, 900.0, 20)
VALUES = 1e-9 * (1.0 + PHASE) * FREQUENCY[:, None]


def a_map(name: str = "map") -> str:
    sheets = [Sheet("one", FREQUENCY, VALUES, "#0b5c9e"), Sheet("two", FREQUENCY[::2], VALUES[::2], "#d1600a")]
    axes_of = (Quantity("mesh phase", "cycles"), Quantity("frequency", "Hz"), Quantity("|ITF|", "m/N"))
    return live_map(name, axes_of, PHASE, sheets, "<svg></svg>", "A map.", start=(0.5, 500.0))


def a_curve(name: str = "curve") -> str:
    traces = [curve(PHASE, [1.0, np.nan, *range(6)], "up </script> & down", "#0b5c9e", mode="lines+markers")]
    return live(name, traces, axes("phase", "y", y=log_axis(1, 10)), "<svg></svg>", "A curve & more.")


def data_in(piece: str) -> dict[str, Any]:
    """What a figure holds for the script."""
    (held,) = re.findall(r'<script type="application/json">(.*?)</script>', piece, re.DOTALL)
    return json.loads(held)


def test_a_page_fetches_nothing_and_holds_the_script_once() -> None:
    page = live_page("A page", [text("Answer", "h1"), a_curve(), a_map()])
    assert fetched(page) == []
    assert "connect-src" not in page and "default-src 'none'" in page
    assert elements(page).count("script") == 4  # data of two figures, plotly, ours
    assert elements(page).count("link") == elements(page).count("iframe") == 0
    assert len(re.findall(r"\* plotly\.js v\d", page)) == 1
    assert fetched('<img src="https://example.org/a.png">') and fetched('<link href="a.css">')


def test_the_names_of_a_curve_cannot_end_its_data() -> None:
    assert data_in(a_curve())["traces"][0]["name"] == "up </script> & down"
    assert "<figcaption>A curve &amp; more.</figcaption>" in a_curve()


def test_plotly_accepts_every_trace_and_layout() -> None:
    """plotly's own validation knows each key; a wrong one raises."""
    import plotly.graph_objects as go

    plain, mapped = data_in(a_curve()), data_in(a_map())
    go.Figure(data=plain["traces"], layout=plain["layout"])
    go.Figure(data=mapped["maps"], layout=mapped["layout"])
    for along in ("layout_x", "layout_y"):
        go.Figure(data=mapped["curves"], layout=mapped[along])
    with pytest.raises(ValueError, match="titel"):
        go.Figure(layout=axes("x", "y", titel="no"))


def test_numbers_come_back_from_what_is_packed() -> None:
    mapped = data_in(a_map())
    rows = np.frombuffer(b64decode(mapped["sheets"][0]["values"]), "<f4").reshape(len(FREQUENCY), len(PHASE))
    assert 10.0**rows == pytest.approx(VALUES, rel=1e-5)
    values = np.frombuffer(b64decode(data_in(a_curve())["traces"][0]["y"]["bdata"]), "<f4")
    assert np.isnan(values[1]) and list(values[2:]) == [0, 1, 2, 3, 4, 5]


def test_thinning_keeps_every_peak() -> None:
    values = np.sin(np.arange(100_000) / 7.0)
    values[[31_415, 77_777]] = 5.0, -6.0
    index, kept = thinned(values, 2_000)
    assert len(kept) <= 2_000 and np.array_equal(values[index], kept)
    assert {31_415, 77_777} <= set(index) and (np.diff(index) > 0).all()
    index, kept = thinned(values[:50])
    assert np.array_equal(kept, values[:50]) and np.array_equal(index, np.arange(50))


def test_the_command_line_loads_plotly_only_for_a_report() -> None:
    code = (
        "import sys, gearbench.cli, gearbench.report.live;"
        "print([name for name in sys.modules if name.split('.')[0] == 'plotly'])"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
