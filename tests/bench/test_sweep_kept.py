"""A sweep that was interrupted goes on at the speed where it was, to the same bits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from shared.rectangular import NONLINEAR

from gearbench.bench import sweep as sweep_module
from gearbench.bench.sweep import DIRECTIONS, sweep
from gearbench.bench.tape import discard
from gearbench.cases import case_path
from gearbench.files import FileError
from gearbench.rig import Case, read_case

LUMPED = (
    *NONLINEAR,
    "rig.support.stiffness_n_per_m=1e9",
    "rig.support.damping_n_s_per_m=2e4",
    "rig.damping.mesh_ratio=0.1",
)
# Wide and heavily damped, or the first look of a small gear on finite elements would wait long.
REDUCED = ("rig.support.damping_n_s_per_m=1e5", "rig.damping.material_ratio=0.1")
SPEEDS = [150.0, 200.0, 260.0, 300.0]


class Counted:
    """Counts the speeds that are looked at, and fails at one of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.begun: list[float] = []
        self.fail_at = -1
        self._whole = sweep_module._look
        monkeypatch.setattr(sweep_module, "_look", self._look)

    def _look(self, *given: Any) -> Any:
        self.begun.append(given[2])
        if len(self.begun) == self.fail_at:
            raise KeyboardInterrupt
        return self._whole(*given)


def interrupted(case: Case, folder: Path, counted: Counted, at: int, workers: int) -> list[float]:
    """The speeds that are looked at after an interruption at the begin of look number `at`, from 1 on."""
    whole = sweep(case, SPEEDS, workers=1)
    counted.begun, counted.fail_at = [], at
    with pytest.raises(KeyboardInterrupt):
        sweep(case, SPEEDS, checkpoints=folder, workers=workers)
    counted.begun, counted.fail_at = [], -1
    again = sweep(case, SPEEDS, checkpoints=folder, workers=workers)
    assert again.identical(whole)
    return counted.begun


@pytest.mark.parametrize("at", [2, 4, 5, 7])
def test_it_goes_on_in_either_direction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: int) -> None:
    case = read_case(case_path("rig_62"), LUMPED)
    rest = interrupted(case, tmp_path / "part", Counted(monkeypatch), at, workers=1)
    assert rest == [*SPEEDS, *SPEEDS[::-1]][at - 1 :]


def test_the_reduced_model_goes_on_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = read_case(case_path("quick_fe"), REDUCED)
    assert len(interrupted(case, tmp_path / "part", Counted(monkeypatch), 3, workers=1)) == 6


def test_side_by_side_both_directions_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = read_case(case_path("rig_62"), LUMPED)
    rest = interrupted(case, tmp_path / "part", Counted(monkeypatch), 6, workers=2)
    assert len(rest) < 2 * len(SPEEDS)
    kept = {path.name.split("-")[1] for path in (tmp_path / "part").glob("tape-*")}
    assert kept == set(DIRECTIONS)


def test_another_sweep_begins_anew_and_a_strangers_folder_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case, folder = read_case(case_path("rig_62"), LUMPED), tmp_path / "part"
    sweep(case, SPEEDS[:2], checkpoints=folder)
    counted = Counted(monkeypatch)
    other = sweep(case, SPEEDS[1:3], checkpoints=folder)
    assert len(counted.begun) == 4
    assert other.identical(sweep(case, SPEEDS[1:3]))
    discard(folder)
    assert not folder.exists()
    folder.mkdir()
    (folder / "thesis.tex").write_text("x")
    with pytest.raises(FileError, match="another origin"):
        sweep(case, SPEEDS, checkpoints=folder)
