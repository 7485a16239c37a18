"""Pictures are reproducible and carry their warning; thinning keeps cells; words follow the numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from gearbench.cases import case_path
from gearbench.figures.gears import gear as figures_gear
from gearbench.figures.gears import static as figures_static
from gearbench.figures.gears.gear import draw_pair
from gearbench.figures.plotting import closed
from gearbench.figures.records.record import draw_record
from gearbench.figures.responses import frf as figures_frf
from gearbench.figures.responses.frf import draw_itf, draw_natural_frequencies
from gearbench.geometry import pair
from gearbench.rig import read_case
from gearbench.words.accuracy import honest_warning, trust
from gearbench.words.summary import headline


def frf(rows: int = 40, phases: int = 32, scale: float = 1.0) -> xr.Dataset:
    frequency, phase = np.linspace(10, 500, rows), np.arange(phases) / phases
    itf = scale * np.outer(1e-9 / (1 + (frequency / 200) ** 2), 2 + np.cos(2 * np.pi * phase))
    natural = 200 + 20 * np.cos(2 * np.pi * phase)
    return xr.Dataset(
        {
            "itf_re": (("frequency", "phase"), itf),
            "itf_im": (("frequency", "phase"), 0 * itf),
            "natural_frequency": (("mode", "phase"), natural[None]),
        },
        coords={"frequency": frequency, "phase": phase},
    )


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are saved."""
    figures: list[Figure] = []
    monkeypatch.setattr(figures_frf, "save", lambda figure, path: figures.append(figure))
    return figures


def test_all_panels_share_one_scale_and_the_warning_is_on_the_picture(drawn: list[Figure]) -> None:
    results = {"identified": frf(scale=3.0), "exact": frf(), "frozen": frf()}
    draw_itf(Path("itf.png"), results, "This record cannot support the ITF")
    (figure,) = drawn
    images = [axes.collections[0] for axes in figure.axes[:3]]
    limits = {image.get_clim() for image in images}
    assert len(limits) == 1
    ((_, high),) = limits
    assert high == pytest.approx(3.0, rel=0.1)  # nm/N: the truth's largest, not the threefold identified one
    assert "cannot support" in figure.get_suptitle()
    assert [axes.get_title() for axes in figure.axes[:3]] == [figures_frf._TITLES[name] for name in results]


def test_natural_frequencies_zoom_on_what_was_found(drawn: list[Figure]) -> None:
    frozen = frf()
    extra = xr.concat([frozen["natural_frequency"], 10 * frozen["natural_frequency"]], dim="mode")
    results = {"identified": frf(), "frozen": frozen.drop_vars("natural_frequency").assign(natural_frequency=extra)}
    draw_natural_frequencies(Path("n.png"), results, [(0.0, 0.2)], "1 tooth pair in contact")
    low, high = drawn[0].axes[0].get_ylim()
    assert 100 < low < 180 and 220 < high < 400
    words = [text.get_text() for text in drawn[0].axes[0].get_legend().get_texts()]
    assert "1 tooth pair in contact" in words and len(words) == 3


def test_maps_are_thinned_without_averaging() -> None:
    large = frf(rows=3000, phases=64)
    phase, frequency, values = figures_frf.coarse_map(large, figures_frf.magnitude(large))
    assert values.shape == (frequency.size, phase.size) and frequency.size <= 1000
    whole = figures_frf.magnitude(large)
    rows = np.searchsorted(large["frequency"].values, frequency)
    assert np.array_equal(values, np.column_stack((whole[rows], whole[rows, :1])))


def test_the_same_picture_gives_the_same_file(tmp_path: Path) -> None:
    case = read_case(case_path("quick_lumped"))
    time = np.arange(100) / 1000
    wave = np.sin(2 * np.pi * 50 * time)[None]
    record = xr.Dataset(
        {"torque_driver": (("realisation", "time"), wave), "dte": (("realisation", "time"), 1e-6 * wave)},
        coords={"time": time},
        attrs={"sampling_rate": 1000.0},
    )
    for number in (1, 2):
        draw_pair(tmp_path / f"pair{number}.png", case.rig, pair(case.rig), None)
        draw_record(tmp_path / f"record{number}.png", record)
    for name in ("pair", "record"):
        first, second = (tmp_path / f"{name}{number}.png" for number in (1, 2))
        assert first.read_bytes() == second.read_bytes() and first.stat().st_size > 10_000


def numbers(**found: float | str) -> dict:
    about = {"expected_error": 0.02, "harmonics": 7, "joint_period": 1.0} | found
    return {"realisations": 1, "identification": about}


def test_warning_is_given_when_the_record_is_short_or_the_error_large() -> None:
    assert honest_warning(numbers()) == ""
    assert honest_warning(numbers(record_duration=5.0, record_needed=4.0)) == ""
    short = honest_warning(numbers(record_duration=1.0, record_needed=30.0))
    assert "record is short" in short and "1 s" in short and "30 s" in short and "smoothed" in short
    large = honest_warning(numbers(expected_error=0.25, truncation_error=0.2, variance_error=0.1))
    assert "25%" in large and "7 a side" in large and "needed" not in large


def test_warning_names_what_limits_and_what_helps() -> None:
    """One cause each, as the result has it: a noisy record is not told that branches are missing."""
    given = {
        "expected_error": 0.1, "limited_by": "noise", "noise_error": 0.09, "branches_error": 0.0, "window_error": 0.04,
        "order": 2, "window": 30,
    }  # fmt: skip
    noise = honest_warning(numbers(**given))
    assert "noise (9.0%)" in noise and "stronger multisine" in noise and "branches" not in noise
    window = honest_warning(numbers(**given | {"limited_by": "window"}))
    assert "windows (4.0%)" in window and "order 2 over 61 Hz" in window and "longer periods" in window
    channels = honest_warning(numbers(**given | {"record_error": 0.1}))
    assert "doubtful channels" in channels
    feedback = {"method": "mesh-feedback", "unexplained_error": 0.0, "variance_error": 0.1}
    assert "noise (10.0%)" in honest_warning(numbers(**given | feedback))
    assert "does not explain" in honest_warning(numbers(**given | feedback | {"unexplained_error": 0.1}))


def test_what_a_mesh_was_told_by_is_said() -> None:
    given = {
        "method": "mesh-feedback", "mesh_harmonics": 150, "unknowns": 440, "equations": 3000, "expected_error": 0.002,
        "variance_error": 0.002, "unexplained_error": 0.0,
    }  # fmt: skip
    zones = {
        "mesh_basis": "zones", "switch_phases": [0.0, 0.6], "switch_width": 0.02, "switch_cubics": 2,
        "evidence_gain": 1290.4, "mesh_determined": 29.7,
    }  # fmt: skip
    assert "with 150 harmonics of the mesh: 440 unknowns" in trust(numbers(**given))[0]
    said = trust(numbers(**given, **zones))[0]
    assert "switches at 0 and 0.6 of the mesh cycle, 0.02 wide, 2 cubic(s)" in said
    assert "gain 1290 in twice the logarithm" in said and "determines 30 numbers" in said
    turned = trust(numbers(**given, **zones, switch_angles_driver=[0.0, 0.06]))[0]
    assert "(0 and 3.44 degrees of the driver)" in turned


def test_headline_orders_the_answers() -> None:
    lines = headline(
        {
            "te_peak_to_peak_um": 1.23456,
            "torque_mean_nm": 2.0,
            "te_mesh_orders_um": [0.5, 0.25, 0.125],
            "first_mode_hz": (1005.4, 1556.4),
            "first_mode_fewest_pairs_hz": 1010.0,
            "first_mode_most_pairs_hz": 1550.0,
        }
    )
    assert lines[0].startswith("Peak-to-peak TE: 1.235 um")
    assert lines[1] == "TE mesh orders 1-3: 0.5, 0.25, 0.125 um"
    assert lines[2].startswith("First mode: 1005-1556 Hz")


def test_a_band_without_a_mode_is_said_in_words() -> None:
    nan = float("nan")
    answers = {"te_peak_to_peak_um": 1.0, "torque_mean_nm": 2.0, "te_mesh_orders_um": [1.0, 1.0, 1.0]}
    modes = {"first_mode_hz": (nan, nan), "first_mode_fewest_pairs_hz": nan, "first_mode_most_pairs_hz": nan}
    assert headline(answers | modes)[2] == "First mode: none in the identified band"


def with_gap(missing: slice) -> xr.Dataset:
    made = frf()
    made["natural_frequency"][0, missing] = np.nan
    return made


def test_the_legends_of_the_gears_lie_outside_the_axes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    figures: list[Figure] = []
    monkeypatch.setattr(figures_gear, "save", lambda figure, path: figures.append(figure))
    case = read_case(case_path("quick_lumped"))
    draw_pair(tmp_path / "gears.png", case.rig, pair(case.rig), None)
    figures[0].savefig(tmp_path / "gears.png")
    for axes in figures[0].axes:
        legend, label = axes.get_legend().get_window_extent(), axes.xaxis.label.get_window_extent()
        assert legend.y1 < axes.get_window_extent().y0 and not legend.overlaps(label)


def test_curves_and_ticks_reach_both_ends_of_the_period(drawn: list[Figure]) -> None:
    draw_natural_frequencies(Path("n.png"), {"identified": frf()}, [], "")
    (axes,) = drawn[0].axes
    phase, values = axes.lines[0].get_data()
    assert (phase[0], phase[-1]) == (0.0, 1.0) and values[0] == values[-1]
    assert axes.get_xlim() == (0.0, 1.0) and {0.0, 1.0} <= set(axes.get_xticks())
    shifted, continued = closed(np.array([0.1, 0.4, 0.7]), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(shifted, [-0.3, 0.1, 0.4, 0.7, 1.1])
    np.testing.assert_array_equal(continued, [3.0, 1.0, 2.0, 3.0, 1.0])


@pytest.mark.parametrize("missing", [slice(5, 9), slice(0, 3), slice(31, None)])
def test_a_gap_in_a_curve_is_explained_on_it(drawn: list[Figure], missing: slice) -> None:
    draw_natural_frequencies(Path("n.png"), {"identified": with_gap(missing)}, [], "")
    draw_natural_frequencies(Path("n.png"), {"identified": frf()}, [], "")
    words = [[text.get_text() for text in figure.axes[0].texts] for figure in drawn]
    assert words == [[figures_frf.NO_MODE], []]


def test_one_load_is_a_curve_and_several_have_a_swing(monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Figure] = []
    monkeypatch.setattr(figures_static, "save", lambda figure, path: figures.append(figure))
    phase = np.arange(8) / 8
    for loads in ([50.0], [50.0, 100.0]):
        te = np.outer(loads, 1e-8 * (2 + np.cos(2 * np.pi * phase)))
        data = {"transmission_error": (("load", "phase"), te)}
        result = xr.Dataset(data, coords={"load": ("load", loads, {"units": "N m"}), "phase": phase})
        figures_static.plot_static(result, Path("static.png"))
    assert [len(figure.axes) for figure in figures] == [1, 2]
    assert all(line.get_xdata()[-1] == 1.0 for figure in figures for line in figure.axes[0].lines)


def test_a_map_ends_where_its_frequencies_end(drawn: list[Figure]) -> None:
    draw_itf(Path("itf.png"), {"identified": frf(rows=5)})  # cells of 122 Hz, the first from 10 - 61 Hz on
    assert drawn[0].axes[0].get_ylim() == (10.0, 500.0)


def test_a_record_without_modes_says_so(drawn: list[Figure]) -> None:
    nothing = frf().isel(mode=slice(0, 0))
    draw_natural_frequencies(Path("n.png"), {"identified": nothing}, [], "")
    axes = drawn[0].axes[0]
    assert [text.get_text() for text in axes.texts] == [figures_frf.NOTHING] and axes.get_legend() is None
