"""Analytic stiffness: the worked example of ISO 6336, and the published programme ROSS."""

from __future__ import annotations

from math import pi

from gearbench.lumped.iso6336 import (
    basic_rack_factor,
    contact_ratio,
    flexibility,
    mesh_stiffness,
    single_stiffness,
    virtual_teeth,
)
from gearbench.validation import Check

DEGREE = pi / 180

# ISO/TR 6336-30:2017, example 1: c'_th, c', c_gamma-alpha [N/(mm um)]. The basic rack is profile D of ISO 53
# (h_fP = 1.4 modules); the tip diameters are those of addendum 1 without shortening, to 0.01 mm as drawn.
ISO_EXAMPLE = (17.85584, 12.37047, 17.46485)
TEETH, SHIFTS, MODULE, HELIX = (17, 103), (0.145, 0.0), 8.0, 15.8 * DEGREE
TIPS, CENTRE_DISTANCE = (159.66, 872.35), 500.0


def iso_6336() -> float:
    """Largest relative error of the three stiffnesses of the example."""
    virtual = [virtual_teeth(z, HELIX) for z in TEETH]
    theoretical = 1 / flexibility(virtual, SHIFTS)
    single = single_stiffness(theoretical, rack=basic_rack_factor(1.4, 20 * DEGREE), helix=HELIX)
    mesh = mesh_stiffness(single, contact_ratio(TEETH, MODULE, TIPS, CENTRE_DISTANCE, HELIX))
    found = (theoretical, single, mesh)
    return max(abs(got / wanted - 1) for got, wanted in zip(found, ISO_EXAMPLE, strict=True))


CHECKS = [Check("iso-6336", "ISO/TR 6336-30 example 1: c'_th, c', c_gamma-alpha", 1e-4, "", iso_6336)]
