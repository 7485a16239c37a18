"""Zones of one and two pairs against the contact ratio and against counting."""

from __future__ import annotations

import numpy as np
import pytest

from gearbench.cases import case_path
from gearbench.geometry import pair
from gearbench.geometry.pair.zones import contact_span, fewest_pairs, pairs_in_contact, zone_label
from gearbench.rig import read_case


@pytest.mark.parametrize("gears", [(62, 62), (25, 62), (25, 25)])
def test_span_and_zones_of_a_pair(gears: tuple[int, int]) -> None:
    settings = [f"rig.driver.teeth={gears[0]}", f"rig.driven.teeth={gears[1]}"]
    settings += ["rig.driver.hub_radius_mm=15", "rig.driver.bore_radius_mm=5", "rig.driven.hub_radius_mm=15"]
    settings += ["rig.driven.bore_radius_mm=5"]
    meshing = pair(read_case(case_path("quick_lumped"), settings).rig)
    span = contact_span(meshing)
    assert span[1] - span[0] == pytest.approx(meshing.contact_ratio, rel=1e-12)
    assert span[0] < 0 < span[1]  # the pitch point lies on the path of contact
    single = sum(stop - start for start, stop in fewest_pairs(span))
    assert single == pytest.approx(2 - meshing.contact_ratio, rel=1e-9)
    assert zone_label(span).startswith("1 tooth pair in")


@pytest.mark.parametrize("span", [(-0.9, 0.7), (-0.2, 1.1), (-1.3, 1.1), (-0.3, 2.4)])
def test_pairs_are_counted_one_by_one(span: tuple[float, float]) -> None:
    for phase in np.linspace(0.003, 0.997, 50):
        count = sum(span[0] <= phase - tooth <= span[1] for tooth in range(-5, 6))
        assert pairs_in_contact(span, phase) == count
        inside = any(start <= phase <= stop for start, stop in fewest_pairs(span))
        assert inside == (count == int(span[1] - span[0]))
    assert zone_label((-1.3, 1.1)).startswith("2 tooth pairs in")


def test_a_whole_contact_ratio_has_no_zones() -> None:
    assert fewest_pairs((-0.5, 1.5)) == []
