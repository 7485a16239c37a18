"""The gears moving: pictures of a pair that turns through the mesh, as a page, a GIF or a film."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.shell.failure import InputError
from gearbench.shell.progress import Silent, Steps

if TYPE_CHECKING:
    from gearbench.figures.gears.motion import Picture
    from gearbench.rig import Case

ENDINGS = (".html", ".gif", ".mp4")
MOST_FRAMES = 600
CURVE = 64  # static positions of the curve below, a mesh cycle
RATE = 8.0  # pictures a second


def check_animation(out: Path, frames: int, cycles: float) -> None:
    """Refuse what cannot be written or drawn, before any work is done. Raises InputError."""
    if not out.parent.is_dir():
        raise InputError(f"--out {out} cannot be written: the folder {out.parent} must exist")
    if out.suffix not in ENDINGS:
        raise InputError(f"--out {out} must end in {', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}")
    if out.suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise InputError("an MP4 needs the program ffmpeg, which is not there: NAME.gif and NAME.html need nothing")
    if not 2 <= frames <= MOST_FRAMES:
        raise InputError(f"--frames {frames} must be between 2 and {MOST_FRAMES}")
    if not 0 < cycles <= frames:
        raise InputError(f"--cycles {cycles:g} must be greater than 0 and at most --frames {frames}")


def animate(
    case: str | Path | Case, out: str | Path, *, torque: float | None = None, record: str | Path | None = None,
    frames: int = 24, cycles: float = 1.0, progress: Steps | None = None,
) -> None:  # fmt: skip
    """Write an animation of a case, as `out` ends: a page (.html), a picture (.gif) or a film (.mp4, by ffmpeg).

    `case`: a file, the name of a shipped case, or a Case. It shows static positions at a driver torque [N m] (absent:
    the case's mean), or the instants of the record in the file `record`, which has tooth forces; `frames` pictures over
    `cycles` mesh cycles. Contact and stress are by finite elements, whatever the model of the case. Raises InputError,
    CaseError, BenchError and what the solver raises, one sentence.

    >>> import gearbench as gb
    >>> gb.animate("quick_fe", "moving.jpg")
    Traceback (most recent call last):
    gearbench.shell.failure.InputError: --out moving.jpg must end in .html, .gif or .mp4
    >>> gb.animate("quick_fe", "moving.gif", torque=100.0, frames=24)  # doctest: +SKIP
    """
    from gearbench.bench.elastic.rig import elastic_rig
    from gearbench.bench.refusals.gears import check_gears
    from gearbench.bench.stress.fields import refuse_cracks
    from gearbench.bench.stress.motion import moving_frames
    from gearbench.cases import read_case
    from gearbench.figures.gears.motion import film, pictures

    steps = progress or Silent()
    out, record = Path(out), Path(record) if record is not None else None
    check_animation(out, frames, cycles)
    case = read_case(case) if isinstance(case, str | Path) else case
    check_gears(case.rig)
    refuse_cracks(case.rig)
    load = _load(case, torque, record)
    steps.step("positions")
    elastic = elastic_rig(case.rig, case.simulation)
    instants, curve, words = _instants(elastic, load, record, frames, cycles)
    steps.step("stress fields")
    found = moving_frames(elastic, instants, case.simulation.element_size, steps)
    steps.step("pictures")
    module = case.rig.driver.module
    shared = film(case.name, found, words, module, curve)
    images = []
    for image in pictures(found, shared, elastic.pair, module):
        images.append(image)
        steps(len(images) / frames)
    steps.step(out.name)
    what = f"{record.name}, its first realisation" if record else f"static positions under {instants[0].torque:g} N m"
    sentences = (
        f"{frames} instants over {cycles:g} mesh cycle{'s' if cycles != 1 else ''}: {what}.",
        f"Stress away from the contacts reaches {shared.top:g} MPa or a little less, one contact at most"
        f" {shared.force:.0f} N (arrows).",
        f"The {words} below runs from {shared.errors.min():.4g} to {shared.errors.max():.4g} um.",
    )
    _write(out, images, case, sentences)


def _load(case: Case, torque: float | None, record: Path | None) -> float:
    """Driver torque [N m] of static positions; 0 where a record says it. Raises InputError or BenchError."""
    from gearbench.bench.refusals.stated import mean_torque

    if record is not None:
        if torque is not None:
            raise InputError("--torque-nm and --record cannot both be given: a record says what its mesh carries")
        return 0.0
    load = mean_torque(case) if torque is None else torque
    if not 0.0 < load < float("inf"):
        raise InputError(f"--torque-nm {load:g} must be finite and greater than 0")
    return load


def _instants(elastic: Any, load: float, record: Path | None, frames: int, cycles: float) -> tuple[Any, Any, str]:
    """What is shown, the curve below it (phases, values), and what the curve is called."""
    import numpy as np

    from gearbench.bench.stress.motion import recorded_instants, static_instants
    from gearbench.records import read_record

    if record is not None:
        held = read_record(record)
        instants = recorded_instants(held, frames, cycles, elastic.pair.driver.base_radius)
        return instants, _recorded_curve(held, instants[0].phase, cycles), "DTE"
    instants = static_instants(elastic, load, cycles * np.arange(frames) / frames)
    phases = np.linspace(0.0, cycles, 1 + round(CURVE * max(cycles, 1.0)))
    errors = np.array([one.dte for one in static_instants(elastic, load, phases)])
    return instants, (phases, errors), "TE"


def _recorded_curve(record: Any, first: float, cycles: float) -> tuple[Any, Any]:
    """Phases and DTE of the first realisation over the cycles shown."""
    phase, dte = record["mesh_phase"].values[0], record["dte"].values[0]
    shown = (phase >= first) & (phase <= first + cycles)
    return phase[shown], dte[shown]


def _write(out: Path, images: list[Picture], case: Case, sentences: tuple[str, ...]) -> None:
    """The animation under its name when it is whole."""
    from gearbench.figures.gears.motion import as_webp, write_gif, write_mp4
    from gearbench.files import write_text, write_whole
    from gearbench.report.animation import animation_page

    if out.suffix == ".html":
        title = f"{case.name}: the teeth through the mesh"
        write_text(out, animation_page(case, title, sentences, [as_webp(one) for one in images], RATE))
        return
    if out.suffix == ".gif":
        write_whole(out, lambda path: write_gif(images, path, RATE))
    else:
        write_whole(out, lambda path: write_mp4(images, path, RATE, shutil.which("ffmpeg") or "ffmpeg"))
