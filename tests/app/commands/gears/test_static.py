"""`static` on the command line: its picture, and what it refuses before any work."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearbench.cli import run_command_line


def test_a_picture_beside_the_result(tmp_path: Path) -> None:
    out, picture = tmp_path / "static.nc", tmp_path / "static.png"
    arguments = ["static", "quick_lumped", "--out", str(out), "--torque-nm", "50", "--torque-nm", "100"]
    assert run_command_line([*arguments, "--positions", "8", "--figure", str(picture)]) == 0
    assert out.stat().st_size > 0 and picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--figure", "{folder}/static.bmp"], "must end in .png or .svg or .pdf"),
        (["--figure", "{folder}/none/static.png"], "must exist"),
        (["--cycles", "3"], "cycles = 3 must be 1"),
        (
            ["--set", f"rig.driver.profile_slope_tooth_um={[1.0] + 61 * [0.0]}"],
            "does not represent rig.driver.profile_slope_tooth_um",
        ),
    ],
)
def test_refusals(tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], words: str) -> None:
    out = tmp_path / "static.nc"
    given = [part.replace("{folder}", str(tmp_path)) for part in more]
    assert run_command_line(["static", "quick_lumped", "--out", str(out), "--positions", "4", *given]) == 2
    assert words in capsys.readouterr().err
    assert not out.exists()
