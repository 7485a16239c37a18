"""Pictures of a pair that turns through the mesh: stress, contact forces, and the transmission error below."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from gearbench.figures.gears.gear import outline, placed
from gearbench.figures.gears.stress import AWAY, rounded_up
from gearbench.figures.plotting import BLUE, GREY, ORANGE, style

if TYPE_CHECKING:
    from gearbench.bench.stress.motion import Frame
    from gearbench.geometry import Pair

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

INCHES, DOTS = (8.4, 8.0), 100  # of a frame, and dots an inch: 840 x 800
BODY = "#e9ecf0"
LONGEST = 1.6  # modules: the arrow of the largest force


@dataclass(frozen=True)
class Film:
    """What all frames share: the curve below (cycles, um) and what it is, the upper limit of the colours [MPa], the
    largest contact force [N]."""

    title: str
    phases: Array
    errors: Array
    error_words: str
    top: float
    force: float


def film(
    title: str, frames: Sequence[Frame], words: str, module: float, curve: tuple[Array, Array] | None = None
) -> Film:
    """What the frames share; `curve`: phases [cycles] and transmission errors [m], absent: those of the frames."""
    phases, errors = curve or (
        np.array([one.instant.phase for one in frames]), np.array([one.instant.dte for one in frames])
    )  # fmt: skip
    forces = [float(np.hypot(*contact.force)) for frame in frames for contact in frame.contacts]
    tops = [_largest(frame, module) for frame in frames if len(frame.points)]
    return Film(title, phases, 1e6 * errors, words, rounded_up(max(tops, default=1.0)), max(forces, default=1.0))


def _largest(frame: Frame, module: float) -> float:
    """Largest von Mises stress [MPa] away from the contacts, whose own is several times that of the roots."""
    away = np.ones(len(frame.points), dtype=bool)
    for one in frame.contacts:
        away &= np.hypot(*(frame.points - one.middle).T) > AWAY * module
    return 1e-6 * float(frame.von_mises[away].max(initial=0.0))


def pictures(frames: Sequence[Frame], shared: Film, meshing: Pair, module: float) -> Iterator[Picture]:
    """Each frame as (height, width, 3) of 0..255."""
    outlines = outline(meshing.driver), outline(meshing.driven)
    for frame in frames:
        yield _picture(frame, shared, meshing, module, outlines)


def _picture(frame: Frame, shared: Film, meshing: Pair, module: float, outlines: tuple[Array, Array]) -> Picture:
    with rc_context(style()):
        drawing = Figure(figsize=INCHES, dpi=DOTS)
        canvas = FigureCanvasAgg(drawing)
        near = drawing.add_axes((0.03, 0.27, 0.80, 0.68))
        whole = drawing.add_axes((0.035, 0.735, 0.22, 0.21))
        below = drawing.add_axes((0.09, 0.065, 0.87, 0.15))
        bar = drawing.add_axes((0.86, 0.31, 0.022, 0.55))
        bodies = _bodies(frame, meshing, outlines)
        _near(near, bar, frame, shared, meshing, module, bodies)
        _whole(whole, frame, meshing, bodies)
        _below(below, frame, shared)
        drawing.text(0.03, 0.965, _heading(frame, shared), fontsize=11)
        canvas.draw()
        held = np.asarray(canvas.buffer_rgba())[:, :, :3]
        return held.copy()


def _heading(frame: Frame, shared: Film) -> str:
    phase, torque = frame.instant.phase, frame.instant.torque
    return f"{shared.title}    mesh phase {phase:.3f}    mesh carries {torque:.4g} N m"


def _bodies(frame: Frame, meshing: Pair, outlines: tuple[Array, Array]) -> list[Array]:
    """Outlines of both gears [mm], turned and in their places."""
    centres = 0.0, meshing.centre_distance
    return [placed(line, turn, centre) for line, turn, centre in zip(outlines, frame.turns, centres, strict=True)]


def _near(
    axes: Any, bar: Any, frame: Frame, shared: Film, meshing: Pair, module: float, bodies: Sequence[Array]
) -> None:
    """The teeth in mesh, their stress, and the forces of the contacts."""
    pitch, half = 1e3 * meshing.pitch_radii[0], 1e3 * _half(meshing, module)
    wide = half * (0.80 * INCHES[0]) / (0.68 * INCHES[1])
    # As artists: a patch would be searched for its extreme points, which takes seconds and is not wanted.
    for body, colour in zip(bodies, (BLUE, ORANGE), strict=True):
        axes.add_artist(Polygon(body, closed=True, facecolor=BODY, edgecolor=colour, lw=1.0))
    net = None
    if len(frame.points):
        points = 1e3 * frame.points
        seen = (np.abs(points[:, 0] - pitch) < 1.1 * wide) & (np.abs(points[:, 1]) < 1.1 * half)
        used, renumbered = np.unique(frame.triangles[seen[frame.triangles].any(axis=1)], return_inverse=True)
        triangles = Triangulation(points[used, 0], points[used, 1], renumbered.reshape(-1, 3))
        values = 1e-6 * frame.von_mises[used]
        net = axes.tripcolor(triangles, values, shading="gouraud", cmap="turbo", vmin=0.0, vmax=shared.top)
        for body, colour in zip(bodies, (BLUE, ORANGE), strict=True):
            axes.plot(*body.T, color=colour, lw=0.8)
    _colours(axes.figure, bar, net, shared)
    unit = 1e3 * LONGEST * module / shared.force
    for one in frame.contacts:
        (x, y), (u, v) = 1e3 * one.middle, unit * one.force
        # One for either gear, each pointing at the flank that it presses.
        for sign in (1.0, -1.0):
            arrow = {"arrowstyle": "-|>", "color": "white", "lw": 2.0, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", (x, y), (x - sign * u, y - sign * v), arrowprops=arrow)
        axes.annotate(
            f"{np.hypot(*one.force):.0f} N", (x - u, y - v), xytext=(6, 0), textcoords="offset points", fontsize=9,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0},
        )  # fmt: skip
    axes.set(xlim=(pitch - wide, pitch + wide), ylim=(-half, half), xticks=[], yticks=[])
    axes.set_aspect("equal")
    axes.grid(visible=False)


def _half(meshing: Pair, module: float) -> float:
    """Half of the height [m] that is shown: the path of contact and a tooth's height on either side."""
    start, stop = meshing.active_driver
    return 2.0 * module + 0.5 * (stop - start) * float(np.cos(meshing.working_pressure_angle))


def _colours(drawing: Any, bar: Any, net: Any, shared: Film) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    shown = net or ScalarMappable(Normalize(0.0, shared.top), "turbo")
    drawing.colorbar(shown, cax=bar, label="von Mises stress [MPa]", extend="max")


def _whole(axes: Any, frame: Frame, meshing: Pair, bodies: Sequence[Array]) -> None:
    """Both gears small, with a mark on tooth 0 by which one sees them turn."""
    for body, colour, turn, x in zip(
        bodies, (BLUE, ORANGE), frame.turns, (0.0, 1e3 * meshing.centre_distance), strict=True
    ):
        axes.add_artist(Polygon(body, closed=True, facecolor="white", edgecolor=colour, lw=0.5, alpha=0.92))
        reach = float(np.hypot(body[:, 0] - x, body[:, 1]).max())
        axes.plot([x, x + reach * np.cos(turn)], [0.0, reach * np.sin(turn)], color=colour, lw=1.0)
    points = np.concatenate(bodies)
    axes.set(xlim=(points[:, 0].min() - 2, points[:, 0].max() + 2), xticks=[], yticks=[])
    axes.set_ylim(points[:, 1].min() - 2, points[:, 1].max() + 2)
    axes.set_aspect("equal")
    axes.axis("off")


def _below(axes: Any, frame: Frame, shared: Film) -> None:
    """The transmission error, and where the frame is on it."""
    axes.plot(shared.phases, shared.errors, color=BLUE, lw=1.4)
    phase, error = frame.instant.phase, 1e6 * frame.instant.dte
    axes.axvline(phase, color=GREY, lw=0.8)
    axes.plot([phase], [error], "o", color=ORANGE, ms=6)
    axes.set(xlabel="mesh phase [cycles]", ylabel=f"{shared.error_words} [um]")
    axes.set_xlim(shared.phases[0], shared.phases[-1])
    axes.margins(y=0.15)


def write_gif(images: Sequence[Picture], path: Path, rate: float) -> None:
    """An animated GIF that begins again at its end; `rate`: pictures a second."""
    from PIL import Image

    held = [Image.fromarray(one) for one in images]
    palette = held[0].quantize(192)
    reduced = [one.quantize(palette=palette, dither=Image.Dither.NONE) for one in held]
    reduced[0].save(
        path, format="GIF", save_all=True, append_images=reduced[1:], duration=round(1000 / rate), loop=0
    )


def write_mp4(images: Sequence[Picture], path: Path, rate: float, ffmpeg: str) -> None:
    """A film by the program `ffmpeg`. Raises OSError with what it says where it fails."""
    height, width = images[0].shape[:2]
    command = [
        ffmpeg, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r",
        f"{rate:g}", "-i", "-", "-an", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(path),
    ]  # fmt: skip
    done = subprocess.run(command, input=b"".join(one.tobytes() for one in images), capture_output=True, check=False)
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise OSError(1, f"ffmpeg: {said[-1] if said else 'it failed'}", str(path))


def as_webp(image: Picture) -> tuple[str, bytes]:
    """A picture for a page, and its media type: WebP, or PNG where pillow lacks it."""
    from PIL import Image, features

    kind = ("webp", {"quality": 82, "method": 4}) if features.check("webp") else ("png", {"optimize": True})
    held = BytesIO()
    Image.fromarray(image).save(held, format=kind[0], **kind[1])
    return f"image/{kind[0]}", held.getvalue()
