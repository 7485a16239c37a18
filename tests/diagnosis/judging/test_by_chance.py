"""What impacts make of a gap by chance, on lines made by hand that each rig's way scatters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from shared.fake_simulator import BLOCKS, LINES, of_lines, sensitivities

from gearbench.diagnosis.judging.by_chance import CLOSE, DRAWN, closed_in_all
from gearbench.diagnosis.judging.closing import closing_of, free_closing
from gearbench.diagnosis.simulation.quadratic import quadratic_of
from gearbench.diagnosis.simulation.target import Block

SIZE, LARGE, RECORD = 8, 30.0, 300.0
WITHOUT, WITH = 0.0, 100.0  # by the first unknown of two rigs it is told which is simulated


class Ways:
    """Rigs whose signals in two kinds of line are off by sizes of their own for each way: in the second by `LARGE`, or
    by `elsewhere` where the effect is not."""

    def __init__(self, without: Sequence[float], with_all: Sequence[float], elsewhere: float = LARGE) -> None:
        self.sizes = {WITHOUT: [(one, elsewhere) for one in without], WITH: [(one, LARGE) for one in with_all]}
        self.gone = {WITHOUT: 0, WITH: 0}
        self.seen: list[np.ndarray] = []
        blocks = [Block("base", "dte", "excited" if n else "operating", (0.0, 1.0)) for n in range(BLOCKS)]
        self.target = replace(of_lines(np.full(LINES, RECORD, dtype=complex)), blocks=tuple(blocks))
        self.layout = SimpleNamespace(unknowns=SimpleNamespace(bounds=lambda: (-np.inf, np.inf)))

    @property
    def free(self) -> Ways:
        return self

    def channels(self, p: np.ndarray, measured: Any) -> dict[str, np.ndarray]:
        rig = WITH if p[0] > 0.5 * WITH else WITHOUT
        self.seen.append(p)
        self.gone[rig] += 1
        if not self.sizes[rig][self.gone[rig] - 1][0]:
            raise ValueError("no rig has these numbers")
        return self.of_size(*self.sizes[rig][self.gone[rig] - 1])

    def of_size(self, *sizes: float) -> dict[str, np.ndarray]:
        return {"lines": RECORD + np.where(self.target.of_line == 0, *sizes).astype(complex)}

    def optimum(self, at: float) -> Any:
        matrix, p = sensitivities(), np.zeros(SIZE)
        p[0] = at
        quadratic = quadratic_of(self.target, np.zeros(LINES, dtype=complex), matrix, np.arange(SIZE))
        return SimpleNamespace(p=p, sd=np.full(SIZE, 0.1), sensitivity=SimpleNamespace(quadratic=quadratic))


EXCITED, OPERATING = ("dte", "excited"), ("dte", "operating")


def told(ways: Ways, parts: Sequence[tuple[str, str]] = (OPERATING,)) -> tuple[tuple[str, str], float] | None:
    found: Any = SimpleNamespace(
        simulator=ways, selection=SimpleNamespace(best=ways.optimum(WITH)), end_of=lambda optimum: optimum.p
    )
    measured: Any = None
    return closed_in_all(found, ways.target, measured, [ways.optimum(WITHOUT)], parts)


@pytest.mark.parametrize(
    ("without", "with_all", "elsewhere", "closes"),
    [
        ((10.0, 8.0, 9.0, 12.0), (1.0, 1.5, 2.0, 1.0), LARGE, True),
        ((10.0, 5.0, 9.0, 12.0), (1.0, 1.5, 3.0, 1.0), LARGE, False),  # one way is as close without the effect
        ((10.0, 8.0, 9.0, 12.0), (1.0, 1.5, 7.0, 1.0), LARGE, False),  # one with it is as far off
        ((10.0, 5.0, 9.0, 12.0), (1.0, 1.5, 3.0, 1.0), 1.07 * LARGE, False),  # though likelier elsewhere
        ((10.0, 8.0, 9.0, 12.0), (1.0, 1.5, 0.0, 1.0), LARGE, False),  # one way is none
    ],
)
def test_a_part_that_is_closer_on_every_way_is_closer_by_the_effect(
    without: Sequence[float], with_all: Sequence[float], elsewhere: float, closes: bool
) -> None:
    """Though the whole is nearly as large either way, by what no effect explains."""
    ways = Ways(without, with_all, elsewhere)
    closed = told(ways)
    assert (closed is not None) is closes
    one, other = ways.of_size(without[0], elsewhere), ways.of_size(with_all[0], LARGE)
    assert not free_closing(ways.target, one, other).due
    assert closing_of(ways.target, one, other).growth > 2.0


def test_it_is_the_part_that_closes_that_is_likelier_and_closer_by_the_search_too() -> None:
    """What other parts say is no evidence for it."""

    def ways() -> Ways:
        return Ways((10.0, 8.0, 9.0, 12.0), (1.0, 1.5, 2.0, 1.0), elsewhere=1.05 * LARGE)

    closed = told(ways(), (EXCITED, OPERATING))
    assert closed is not None and closed[0] == OPERATING
    assert closed[1] == pytest.approx(4.0)  # 8 over 2
    assert told(ways(), (EXCITED,)) is None
    few = ways()
    few.target = replace(few.target, counts=np.array([0.5, *few.target.counts[1:]]))
    assert told(few) is None


def test_rigs_are_drawn_close_by_what_the_records_tell() -> None:
    ways = Ways((1.0,) * DRAWN, (1.0,) * DRAWN)
    assert told(ways) is None
    quadratic = ways.optimum(WITH).sensitivity.quadratic
    matrix = quadratic.information(np.zeros(SIZE)) + np.eye(SIZE) / 0.1**2
    away = [p - (ways.optimum(WITH).p if p[0] > 0.5 * WITH else 0.0) for p in ways.seen]
    sizes = [float(one @ matrix @ one) / (CLOSE**2 * SIZE) for one in away]
    assert len(sizes) == 2 * DRAWN and min(sizes) > 0.1 and max(sizes) < 4.0 and np.ptp(sizes) > 0.0
