"""`static --fields`: which files there will be, and how they come about."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.shell.failure import InputError, say

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.rig import Case
    from gearbench.shell.progress import Progress

LARGEST_PHASE = 1e4  # cycles


def field_phases(words: Sequence[str]) -> list[float]:
    """Mesh phases [cycles] from `--fields 0 0.25` or `--fields 0,0.25`, without repetitions. Raises InputError."""
    found: list[float] = []
    for word in (part for text in words for part in text.split(",")):
        try:
            phase = float(word)
        except ValueError:
            raise InputError(f"--fields {word!r} is not a mesh phase: numbers in cycles, as 0 0.25 0.5") from None
        if not (isfinite(phase) and abs(phase) <= LARGEST_PHASE):
            raise InputError(f"--fields {word} must be a mesh phase between {-LARGEST_PHASE:g} and {LARGEST_PHASE:g}")
        if phase not in found:
            found.append(phase)
    return found


def field_files(out: Path, phases: Sequence[float], others: Sequence[Path | str]) -> list[tuple[float, Path, Path]]:
    """Each phase with its .vtu file and its picture beside `out`. Raises InputError where two names are the same."""
    files = []
    for phase in phases:
        text = f"{phase:.3f}" if abs(phase - round(phase, 3)) < 1e-12 else repr(phase)
        stem = f"{out.stem}_phase{text}"
        files.append((phase, out.with_name(stem + ".vtu"), out.with_name(stem + ".png")))
    taken = {Path(path).resolve() for path in others}
    for _, fields, picture in files:
        for path in (fields, picture):
            if path.resolve() in taken:
                raise InputError(f"--fields would replace {path}, one of the other files: choose another --out")
    return files


def write_all(
    case: Case, result: xr.Dataset, files: Sequence[tuple[float, Path, Path]], progress: Progress
) -> list[Path]:
    """Recover, write and draw the fields at each phase under the largest load of a static result."""
    from gearbench.bench.elastic.rig import elastic_rig
    from gearbench.bench.stress.fields import field_dte, pair_fields, stress_gears, write_fields
    from gearbench.figures.gears.stress import plot_fields
    from gearbench.figures.gears.stress_scene import can_render, render_fields
    from gearbench.files import write_whole

    progress.step("stress fields")
    elastic = elastic_rig(case.rig, case.simulation)
    gears = stress_gears(elastic, case.simulation.element_size)
    load = float(result["load"].values.max())
    rendered = can_render()
    if not rendered:
        say("pyvista cannot draw off screen here (it needs EGL, OSMesa or a display): pictures by matplotlib instead")
    written = []
    for number, (phase, path, picture) in enumerate(files):
        fields = pair_fields(elastic, gears, phase, field_dte(elastic, phase, load, result["load"].attrs["units"]))
        write_fields(path, fields)
        draw = render_fields if rendered else plot_fields
        write_whole(picture, partial(draw, fields, case.rig.driver.module))
        written += [path, picture]
        progress((number + 1) / len(files), f"mesh phase {phase:g}")
    return written
