"""Animations: pictures that differ where the frames do, files that play, refusals before any work."""

from __future__ import annotations

import json
import re
from base64 import b64decode
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from shared.pages import fetched

from gearbench.bench.stress.fields import Contact
from gearbench.bench.stress.motion import Frame, Instant
from gearbench.cases import read_case
from gearbench.cli import run_command_line
from gearbench.figures.gears.motion import Picture, as_webp, film, pictures, write_gif, write_mp4
from gearbench.geometry import pair
from gearbench.report.animation import animation_page


def a_frame(phase: float, stress: float) -> Frame:
    """One triangle under a uniform stress, large enough to be seen, and a force."""
    points = np.array([[0.058, -0.006], [0.066, -0.006], [0.062, 0.006]], np.float32)
    pitch = 2 * np.pi / 62
    contact = Contact(np.array([0.062, 0.0]), 1e-4, np.array([-300.0, -900.0]))
    triangles = np.array([[0, 1, 2]], np.int32)
    instant = Instant(phase, 100.0, 1e-6 * (5 + phase))
    return Frame(instant, (phase * pitch, np.pi - phase * pitch), points, triangles,
                 np.full(3, stress, np.float32), (contact,))  # fmt: skip


@pytest.fixture(scope="module")
def drawn() -> list[Picture]:
    case = read_case("quick_lumped")
    frames = [a_frame(0.0, 20e6), a_frame(0.5, 90e6)]
    shared = film("quick", frames, "TE", case.rig.driver.module)
    assert (shared.top, shared.force) == (100.0, pytest.approx(np.hypot(300, 900)))
    assert list(shared.errors) == pytest.approx([5.0, 5.5])
    return list(pictures(frames, shared, pair(case.rig), case.rig.driver.module))


def test_stress_has_the_colour_of_its_value(drawn: list[Picture]) -> None:
    """Against the colour map itself, at a place inside the triangle and off the arrows."""
    from matplotlib import colormaps

    height, width = drawn[0].shape[:2]
    row, column = round(0.52 * height), round(0.43 * width)
    for image, part in zip(drawn, (0.2, 0.9), strict=True):
        expected = 255 * np.array(colormaps["turbo"](part)[:3])
        near = image[row - 30 : row + 30, column - 20 : column + 20].reshape(-1, 3).astype(float)
        assert (np.abs(near - expected).max(axis=1) < 8).mean() > 0.2


def test_a_gif_holds_every_picture_and_begins_again(drawn: list[Picture], tmp_path: Path) -> None:
    write_gif(drawn, tmp_path / "a.gif", 8.0)
    with Image.open(tmp_path / "a.gif") as held:
        assert (held.n_frames, held.info["loop"], held.size) == (2, 0, (840, 800))
        assert held.info["duration"] == pytest.approx(125, abs=5)  # a GIF counts hundredths of a second
        held.seek(1)
        apart = np.abs(np.asarray(held.convert("RGB")).astype(float) - drawn[1])
    assert np.median(apart) < 3 and apart.mean() < 6


def test_the_page_holds_every_picture_and_fetches_nothing(drawn: list[Picture]) -> None:
    page = animation_page(read_case("quick_lumped"), 'A "title"', ["One."], [as_webp(one) for one in drawn], 8.0)
    assert fetched(page) == []
    (held,) = re.findall(r'<script type="application/json">(.*?)</script>', page, re.DOTALL)
    kept = [Image.open(BytesIO(b64decode(address.split(",")[1]))) for address in json.loads(held)]
    assert [one.size for one in kept] == [(840, 800)] * 2
    assert np.abs(np.asarray(kept[1].convert("RGB")).astype(float) - drawn[1]).mean() < 5
    assert '<option value="8" selected>' in page and 'alt="A &quot;title&quot;"' in page


def test_a_film_gets_every_byte_and_a_failure_its_sentence(drawn: list[Picture], tmp_path: Path) -> None:
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\ncat > "$last"\n', encoding="utf-8")
    program.chmod(0o755)
    write_mp4(drawn, tmp_path / "a.mp4", 8.0, str(program))
    assert (tmp_path / "a.mp4").read_bytes() == b"".join(one.tobytes() for one in drawn)
    program.write_text("#!/bin/sh\ncat > /dev/null\necho 'no such codec' >&2\nexit 3\n", encoding="utf-8")
    with pytest.raises(OSError, match="ffmpeg: no such codec"):
        write_mp4(drawn, tmp_path / "b.mp4", 8.0, str(program))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--out", "{folder}/a.avi"], "must end in .html, .gif or .mp4"),
        (["--out", "{folder}/none/a.gif"], "must exist"),
        (["--out", "{folder}/a.mp4"], "needs the program ffmpeg"),
        (["--out", "{folder}/a.gif", "--frames", "1"], "--frames 1 must be between 2 and 600"),
        (["--out", "{folder}/a.gif", "--cycles", "0"], "--cycles 0 must be greater than 0"),
        (["--out", "{folder}/a.gif", "--torque-nm", "-5"], "--torque-nm -5 must be finite and greater than 0"),
        (["--out", "{folder}/a.gif", "--torque-nm", "5", "--record", "r.nc"], "cannot both be given"),
        (["--out", "{folder}/a.gif", "--set", "rig.driver.crack={tooth=1, stiffness_loss=0.1}"], "rig.driver.crack"),
    ],
)
def test_refusals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], more: list[str], words: str
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    given = [part.replace("{folder}", str(tmp_path)) for part in more]
    assert run_command_line(["animate", "quick_fe", *given]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
