"""The picture of where a gap is: numbers of teeth that can be read, however many there are."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from gearbench.diagnosis.verdict import Share
from gearbench.figures.gaps import diagnosis


@pytest.mark.parametrize(("driver", "driven"), [(12, 18), (19, 57), (60, 120)])
def test_numbers_of_teeth_do_not_lie_on_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, driver: int, driven: int
) -> None:
    gears = (("driver", driver), ("driven", driven))
    shares = [
        Share(kind="tooth", name=f"{gear} {tooth}", share=1.0 / (driver + driven), floor=None)
        for gear, count in gears
        for tooth in range(count)
    ]
    save, boxes = diagnosis.save, []

    def measured(drawing: Any, path: Path) -> None:
        save(drawing, path)
        labels = [one for one in drawing.axes[-1].get_xticklabels() if one.get_text()]
        boxes.extend((one.get_text(), one.get_window_extent()) for one in labels)

    monkeypatch.setattr(diagnosis, "save", measured)
    diagnosis.draw_where(tmp_path / "where.png", shares)
    assert len(boxes) > 10 and [text for text, _ in boxes].count("0") == 2
    assert all(one.x1 < two.x0 for (_, one), (_, two) in pairwise(boxes))
