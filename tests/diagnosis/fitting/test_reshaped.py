"""Reliefs that the nominal flanks lack, of several times the deflection of the mesh: no slope leads there from none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shared.simulated_lines import demonstration

from gearbench.diagnosis.effects.profile_error import FLANKS, PROFILE_ERROR
from gearbench.diagnosis.fitting.background import prior_of
from gearbench.diagnosis.fitting.reshaped import has_shapes, reshaped
from gearbench.diagnosis.forces.basis import FORM_PARTS, PLACES_ON_PATH, in_parts
from gearbench.diagnosis.structure.contrast import BEYOND, CONTRAST, CONTRAST_SD, is_strange

RELIEF = 18e-6


def test_shapes_belong_to_the_form_of_flanks_alone() -> None:
    simulator = demonstration()
    model, unknowns = simulator.layout.model, simulator.layout.unknowns
    wave, form, slope = PROFILE_ERROR.hypotheses(model)
    assert has_shapes(form) and not has_shapes(wave) and not has_shapes(slope)
    shapes = PROFILE_ERROR.shapes(model) @ FORM_PARTS
    assert shapes.shape == (26, len(PLACES_ON_PATH)) and np.isfinite(shapes).all()
    assert shapes.min() == pytest.approx(-4.5 * model.deflection)
    assert shapes[:, 3] == pytest.approx(np.zeros(26), abs=1e-12)
    p = np.zeros(unknowns.size)
    assert not is_strange(unknowns, p)
    p[unknowns[CONTRAST]] = -1.01 * BEYOND * CONTRAST_SD
    assert is_strange(unknowns, p)


@pytest.mark.validation
def test_deep_reliefs_are_found_from_a_shape() -> None:
    """Linear from a quarter of the path inwards, which the nodes of the form hold exactly."""
    simulator = demonstration()
    unknowns = simulator.layout.unknowns
    true = np.zeros(unknowns.size)
    place = np.array(PLACES_ON_PATH)
    relief = np.maximum(1.0 - 4.0 * np.minimum(place, 1.0 - place), 0.0)
    true[unknowns[FLANKS]] = in_parts(-RELIEF * relief)
    true[unknowns["stiffness"]] = 0.05, -0.05
    lines = simulator.lines(true)
    assert lines is not None
    simulator = replace(simulator, target=replace(simulator.target, lines=lines))
    _, form, _ = PROFILE_ERROR.hypotheses(simulator.layout.model)
    found = reshaped(simulator, form, form.widened(unknowns, prior_of(simulator, unknowns.prior())))
    assert found is not None
    flanks = found.p[unknowns[FLANKS]] @ FORM_PARTS
    assert flanks[[0, -1]] - flanks[3] == pytest.approx(-RELIEF, rel=0.15)
    assert found.p[unknowns["stiffness"]] == pytest.approx([0.05, -0.05], abs=0.03)
