"""Internal dynamic factor K_v by ISO 6336-1, Method B: what a standard expects of the teeth's own dynamics.

Formulas and constants are those of ISO 6336-1:2006, 6.5, Method B: the resonance speed n_E1, K_v below, at, between and
above resonance, and the table of C_v1 .. C_v7. Gears are solid spur discs that turn freely; running-in allowances are
left out, so that errors count as they are. Loads are F_t K_A / b in N/mm, stiffness in N/(mm um), deviations in um.
"""

from __future__ import annotations

from math import pi, sin, sqrt
from typing import NamedTuple

HIGH_LOAD = 100.0  # N/mm: below it resonance reaches further down in speed
RESONANCE_END, ABOVE = 1.15, 1.5  # resonance ratios


class Factors(NamedTuple):
    """C_v1 .. C_v7."""

    v1: float
    v2: float
    v3: float
    v4: float
    v5: float
    v6: float
    v7: float


class Deviations(NamedTuple):
    """B_p, B_f, B_k: effects of base pitch error, profile error and tip relief, relative to the tooth's deflection."""

    pitch: float
    profile: float
    relief: float


def factors(contact_ratio: float) -> Factors:
    """C_v1 .. C_v7 of a total contact ratio eps_gamma above 1."""
    e = contact_ratio
    if e <= 1.5:
        v7 = 0.75
    else:
        v7 = 0.125 * sin(pi * (e - 2)) + 0.875 if e <= 2.5 else 1.0
    if e <= 2.0:
        return Factors(0.32, 0.34, 0.23, 0.90, 0.47, 0.47, v7)
    high = (0.57 / (e - 0.3), 0.096 / (e - 1.56), (0.57 - 0.05 * e) / (e - 1.44), 0.47, 0.12 / (e - 1.74))
    return Factors(0.32, *high, v7)


def deviations(
    load: float, single: float, *, base_pitch: float = 0.0, profile: float = 0.0, tip_relief: float = 0.0
) -> Deviations:
    """B_p, B_f, B_k at a load [N/mm] and single stiffness c' [N/(mm um)]; deviations in um."""
    deflection = load / single
    return Deviations(base_pitch / deflection, profile / deflection, abs(1 - tip_relief / deflection))


def resonance_speed(teeth: int, mesh_stiffness: float, masses: tuple[float, float]) -> float:
    """n_E1 [1/min] of a pinion with `teeth`; mesh stiffness [N/(mm um)], masses m* of both gears per face width on
    their base circles [kg/mm]."""
    reduced = masses[0] * masses[1] / (masses[0] + masses[1])
    return 30000 / (pi * teeth) * sqrt(mesh_stiffness / reduced)


def dynamic_factor(ratio: float, load: float, contact_ratio: float, b: Deviations) -> float:
    """K_v at a resonance ratio N = n1/n_E1 and a load [N/mm]."""
    c = factors(contact_ratio)
    begin = 0.85 if load >= HIGH_LOAD else 0.5 + 0.35 * sqrt(load / HIGH_LOAD)
    peak = c.v1 * b.pitch + c.v2 * b.profile + c.v4 * b.relief + 1
    above = c.v5 * b.pitch + c.v6 * b.profile + c.v7
    if ratio <= begin:
        return ratio * (c.v1 * b.pitch + c.v2 * b.profile + c.v3 * b.relief) + 1
    if ratio <= RESONANCE_END:
        return peak
    if ratio >= ABOVE:
        return above
    return above + (peak - above) * (ABOVE - ratio) / (ABOVE - RESONANCE_END)
