"""What may be asked of elastic flanks: the loads and tip edges that are modelled. Loads neither elements nor Numba."""

from __future__ import annotations

from gearbench.geometry import Pair, pair
from gearbench.rig import Gear, Rig

LOAD_RANGE = (1e1, 3e6)  # per unit of common face width [N/m]
EDGE_SEPARATION = 0.05  # of the module: how far a tip edge is followed beyond the line of action
EDGE_RADIUS_LEAST = 5e-6  # [m]


def rounded(gear: Gear) -> Gear:
    """The gear with a tip edge that elasticity can turn around: a sharper one is rounded to EDGE_RADIUS_LEAST."""
    return gear.model_copy(update={"tip_edge_radius": max(gear.tip_edge_radius, EDGE_RADIUS_LEAST)})


def elastic_pair(rig: Rig) -> Pair:
    """The pair as the elastic gears see it: a tip edge sharper than elasticity can resolve is rounded."""
    return pair(rig.model_copy(update={"driver": rounded(rig.driver), "driven": rounded(rig.driven)}))
