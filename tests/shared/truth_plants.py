"""Small cases and plants that the tests of the challenge share."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearbench.challenge.truth.levels import Levels, background
from gearbench.challenge.truth.plant import Plant, Teeth, Tone
from gearbench.challenge.truth.rigs import Bench, build_plant, conditions_of, make_bench
from gearbench.challenge.truth.structure import draw_structure
from gearbench.rig import Case, read_case

CASES = Path(__file__).resolve().parents[2] / "cases"
STIFFNESS = 4.2e8  # N/m, about the mean of the nominal mesh


def short_case() -> Case:
    """The nominal rig with one condition, whose hunting period lasts 0.117 s."""
    settings = ("experiment.mesh_frequency_hz=512", "experiment.samples_per_period=1200")
    return read_case(CASES / "gap_demo.toml", settings).model_copy(update={"conditions": ()})


def short_bench() -> Bench:
    """That case made ready without finite elements."""
    return make_bench(short_case(), STIFFNESS)


def drawn_levels(seed: int = 1) -> Levels:
    """Background levels."""
    return background((20, 30), np.random.default_rng(seed))


def drawn_plant(family: str = "test", seed: int = 1) -> Plant:
    """A truth rig as drawn, with all background levels."""
    bench = short_bench()
    structure = draw_structure(bench.nominal, family, np.random.default_rng(seed))
    return build_plant(bench, structure, drawn_levels(seed), conditions_of(bench.nominal)[0].experiment)


def even_teeth(teeth: Teeth, stiffness: float) -> Teeth:
    """Exactly one pair in contact anywhere, of constant stiffness; no errors, cracks, damping or friction."""
    ones = np.ones_like(teeth.stiffness)
    return teeth._replace(
        first=-0.5,
        pitch=1.0 / (teeth.stiffness.size - 1),
        stiffness=stiffness * ones,
        excess=0.0 * ones,
        error_driver=0.0 * teeth.error_driver,
        error_driven=0.0 * teeth.error_driven,
        crack_driver=0.0 * teeth.crack_driver,
        crack_driven=0.0 * teeth.crack_driven,
        damping=0.0,
        damping_quadratic=0.0,
        friction=0.0,
    )


def undamped(plant: Plant) -> Plant:
    """The plant at standstill without dampers and without torque of its own."""
    return plant._replace(
        teeth=even_teeth(plant.teeth, 4e8),
        speed_driver=0.0,
        speed_driven=0.0,
        support_damping=np.zeros(4),
        mode_damping=np.zeros(2),
        coupling=plant.coupling._replace(damping=0.0, limit=0.0, slip=1.0),
        shaft=plant.shaft._replace(damping=0.0),
        governor=plant.governor._replace(damping=0.0),
        ripple=0.0 * plant.ripple,
        tone=Tone(0.0, 0.0, 0.0),
    )
