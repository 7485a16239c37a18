"""Pictures of two sets of results side by side, one a quantity."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, ORANGE, closed, explain_gaps, figure, phase_axis, save
from gearbench.figures.responses.frf import NO_MODE, draw_itf
from gearbench.words.accuracy import ENOUGH, limit_and_advice

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.results.compare import Results
    from gearbench.shell.output import Output

Array = NDArray[np.float64]

FINE = 512  # phases of a curve
_FLAT = 5.0  # ratio of two curves' sizes from which each gets a scale of its own


def draw_comparison(output: Output, one: Results, two: Results) -> list[str]:
    """All pictures that both results allow; the names of the files written."""
    pairs = paired_curves(one, two)
    written = []
    for name, (title, unit, curves) in pairs.items():
        written.append(f"{name}.png")
        output.write(written[-1], partial(_draw_curves, title=title, unit=unit, curves=curves))
    if panels := paired_responses(one, two):
        written.append("itf.png")
        warning = " ".join(note for letter, result in (("a", one), ("b", two)) if (note := _short(letter, result)))
        output.write(written[-1], lambda path: draw_itf(path, panels, warning))
    return written


def paired_curves(one: Results, two: Results) -> dict[str, tuple[str, str, list[tuple[str, Array]]]]:
    """Curves over the mesh phase that both results have: name -> title, label of the ordinate, each one's name and
    values on FINE uniform phases."""
    from gearbench.bench.results.compare import on_phases
    from gearbench.bench.results.measures import synchronous_mean

    pairs: dict[str, tuple[str, str, list[tuple[str, Array]]]] = {}
    for result in (one, two):
        if result.static is not None:
            phase, static = result.static["phase"].values, result.static
            for name, key, title, unit, scale in (
                ("stiffness", "stiffness_tangent", "Tangent mesh stiffness", "k [N/um]", 1e-6),
                ("static_te", "transmission_error", "Static transmission error", "TE [um]", 1e6),
            ):
                curve = on_phases(phase, scale * static[key].values[0], FINE, result.shift)
                load = f"{static['load'].values[0]:g} {static['load'].attrs['units']}"
                pairs.setdefault(name, (title, unit, []))[2].append((f"{result.name}, {load}", curve))
        if result.record is not None:
            phase, mean = synchronous_mean(result.record)
            curve = on_phases(phase, 1e6 * mean, FINE, result.shift)
            title = "DTE of the record, mean over its mesh periods"
            pairs.setdefault("dte", (title, "DTE [um]", []))[2].append((named(result), curve))
        if result.frf is not None and result.frf.sizes.get("mode", 0):
            phase, natural = result.frf["phase"].values, result.frf["natural_frequency"].values[0]
            curve = on_phases(phase, natural, FINE, result.shift)
            curve[on_phases(phase, np.isnan(natural).astype(float), FINE, result.shift) > 0.0] = np.nan
            entry = pairs.setdefault("natural_frequency", ("First natural frequency", "frequency [Hz]", []))
            entry[2].append((named(result), curve))
    return {name: found for name, found in pairs.items() if len(found[2]) == 2}


def paired_responses(one: Results, two: Results) -> dict[str, xr.Dataset]:
    """Both frequency responses over the frequencies that both have, by their names; empty unless both have one."""
    if one.frf is None or two.frf is None:
        return {}
    panels = {f"{letter}: {named(result)}": _shifted(result) for letter, result in (("a", one), ("b", two))}
    low = max(float(frf["frequency"].min()) for frf in panels.values())
    high = min(float(frf["frequency"].max()) for frf in panels.values())
    return {name: frf.sel(frequency=slice(low, high)) for name, frf in panels.items()}


def named(result: Results) -> str:
    """Name of a result, and the model that it is of."""
    held = result.record if result.record is not None else result.frf
    model = held.attrs.get("model", "") if held is not None else ""
    return f"{result.name}, {model} model" if model else result.name


def _short(letter: str, result: Results) -> str:
    """The expected error of a response, and what limits it, where it is large."""
    about = result.frf.attrs if result.frf is not None else {}
    if about.get("expected_error", 0.0) <= ENOUGH:
        return ""
    limit = f", limited by {limit_and_advice(about)[0]}" if "harmonics" in about else ""
    return (
        f"{letter}: expected error of the ITF {about['expected_error']:.0%} rms and several times that at the"
        f" switches{limit}."
    )


def _draw_curves(path: Path, title: str, unit: str, curves: list[tuple[str, Array]]) -> None:
    """Two curves in one panel, or in two where one would be flat beside the other."""
    phase = np.arange(FINE) / FINE
    sizes = [float(np.nanmax(np.abs(curve))) for _, curve in curves]
    panels = 2 if max(sizes) > _FLAT * min(sizes) else 1
    with figure(panels, 1, (8.0, 4.4 + 1.6 * (panels - 1)), sharex=True, squeeze=False) as (drawing, axes):
        for number, (colour, (name, curve)) in enumerate(zip((BLUE, ORANGE), curves, strict=True)):
            panel = axes[number % panels, 0]
            # The first one broad, so that it is seen where both are the same.
            panel.plot(*closed(phase, curve), color=colour, lw=(3.0, 1.2)[number], label=f"{'ab'[number]}: {name}")
            panel.set_ylabel(unit)
            panel.margins(y=0.25)
            panel.legend(loc="upper center", ncols=2)
        phase_axis(axes[-1, 0])
        for number, (_, curve) in enumerate(curves):
            explain_gaps(axes[number % panels, 0], *closed(phase, curve), NO_MODE)
        axes[0, 0].set_title(title if panels == 1 else f"{title} (mind the two scales)")
        save(drawing, path)


def _shifted(result: Results) -> Any:
    """The frequency response with its phases moved by the results' shift, in rising order."""
    assert result.frf is not None
    frf = result.frf
    return frf.assign_coords(phase=(frf["phase"] + result.shift) % 1.0).sortby("phase")
