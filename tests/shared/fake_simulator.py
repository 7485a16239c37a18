"""A stand-in for simulations: lines that depend on a few unknowns by a formula, in blocks made by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from types import SimpleNamespace
from typing import Any

import numpy as np

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.fitting.background import background
from gearbench.diagnosis.fitting.shown import Shown
from gearbench.diagnosis.forces.unknowns import Unknowns, group, unknowns_of
from gearbench.diagnosis.selection.by_forces import Start, begun_by_forces
from gearbench.diagnosis.selection.selection import Selection, select
from gearbench.diagnosis.simulation.target import Block, Target

LINES, BLOCKS = 60, 6
# Unknowns of `beyond_a_hill` as its rig has them.
ACROSS = np.array([0.08, -0.1, 0.02, 0.4, 0.23, 0.21, 0.0, 0.0])


def unknowns() -> Unknowns:
    """Three of the background, two effects, and two teeth that no background cracks."""
    return unknowns_of(
        [
            group("stiffness", "1", ("driver", "driven", "more"), 0.1, slot="stiffness"),
            group("friction", "1", ("coefficient",), 0.01, 0.5, slot="friction"),
            group("ripple", "1", ("cos", "sin"), 0.01, 0.5, slot="torque"),
            group("crack", "1", 2, 0.02, 0.35, slot="loss", low=0.0),
        ],
        2,
    )


def beyond_a_hill(matrix: np.ndarray) -> tuple[Unknowns, Callable[[np.ndarray], np.ndarray]]:
    """Unknowns, and their lines by what each does (8, LINES): yielding across a little makes worse what `ACROSS` makes
    right, so that no fit gets there from rigid."""
    listed = unknowns_of(
        [
            group("stiffness", "1", ("driver", "driven", "more"), 0.1, slot="stiffness"),
            group("friction", "1", ("coefficient",), 0.01, 0.5, slot="friction"),
            group("across", "1", ("driver", "driven"), 0.15, slot="structure", low=0.0, high=1.0),
            group("crack", "1", 2, 0.02, 0.35, slot="loss", low=0.0),
        ],
        2,
    )

    def lines_of(p: np.ndarray) -> np.ndarray:
        across = p[4:6]
        return np.asarray(np.concatenate([p[:4], 10 * (across**2 - 0.08 * across), p[6:]]) @ matrix)

    return listed, lines_of


def target(lines: np.ndarray, floor: float = 1e-6) -> Target:
    """Six blocks of ten lines each."""
    of_line = np.arange(LINES) % BLOCKS
    blocks = tuple(Block("base", "dte", "excited", (float(i), float(i + 1))) for i in range(BLOCKS))
    return Target(
        measurements=(),
        plan=(),
        lines=lines,
        of_line=of_line,
        blocks=blocks,
        floors=np.full(BLOCKS, floor),
        noise=np.zeros(BLOCKS),
        counts=np.full(BLOCKS, 8.0),
        sizes=np.bincount(of_line).astype(float),
        gains=np.ones(LINES),
    )


def noisy(lines: np.ndarray, seed: int = 11) -> np.ndarray:
    """Lines (LINES,) with noise."""
    rng = np.random.default_rng(seed)
    return lines + 0.02 * (rng.standard_normal(LINES) + 1j * rng.standard_normal(LINES))


class OfLines(Target):
    """A target whose signals are the lines themselves."""

    def gathered(self, channels: Sequence[Mapping[str, Any]]) -> np.ndarray:
        return channels[0]["lines"]


def of_lines(lines: np.ndarray, **changes: Any) -> OfLines:
    """The same blocks of ten such lines each."""
    plain = target(lines)
    return OfLines(**({one.name: getattr(plain, one.name) for one in fields(plain)} | changes))


def chosen(
    simulator: FakeSimulator,
    hypotheses: Sequence[Hypothesis],
    beginnings: Sequence[np.ndarray],
    starts: Mapping[str, Start],
    shown: Shown | None = None,
    *,
    apart: bool = False,
) -> Selection | None:
    """The selection beside the background's optimum; None without one."""
    here: Any = simulator
    base = background(here, beginnings, shown)
    if base is None:
        return None
    base, begun = begun_by_forces(here, base, hypotheses, starts, shown)
    return select(here, base, hypotheses, begun, shown=shown, apart=apart)


def sensitivities(seed: int = 0) -> np.ndarray:
    """A matrix (size, LINES): what each unknown does."""
    rng = np.random.default_rng(seed)
    size = unknowns().size
    return rng.standard_normal((size, LINES)) + 1j * rng.standard_normal((size, LINES))


@dataclass
class FakeSimulator:
    """Lines `of(p)`; derivatives by central differences. None wherever an unknown exceeds `largest`."""

    of: Callable[[np.ndarray], np.ndarray]
    target: Target
    largest: float = np.inf
    layout: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(unknowns=unknowns()))
    jacobians: int = 0

    def of_record(self, number: int) -> FakeSimulator:
        """It has one record."""
        assert number == 0
        return self

    def lines(self, p: np.ndarray) -> np.ndarray | None:
        return None if np.abs(p).max() > self.largest else self.of(p)

    def moved(self, p: np.ndarray, sd: np.ndarray, chosen: np.ndarray) -> np.ndarray | None:
        """As if everything had to be moved."""
        return self.jacobian(p, sd, chosen)

    def jacobian(
        self, p: np.ndarray, sd: np.ndarray, chosen: np.ndarray, near: np.ndarray | None = None
    ) -> np.ndarray | None:
        self.jacobians += 1
        if self.lines(p) is None:
            return None
        out = np.zeros((p.size, self.target.lines.size), dtype=complex)
        for number in np.flatnonzero(chosen):
            step = np.zeros(p.size)
            step[number] = 1e-4
            out[number] = (self.of(p + step) - self.of(p - step)) / 2e-4
        return out
