"""What each model leaves out, for the end of a report; docs/physics.md says it at length."""

from __future__ import annotations

EVERYWHERE = (
    "heat, wear as a process, lubricant films, unbalance, helical teeth and several stages",
    "webs and rims: a gear is a disc from its hub circle outwards, its hub is rigid",
)
ELASTIC = (
    "the third dimension: elasticity is plane and the pressure uniform over the face width",
    "plasticity, and friction in static results",
)
LUMPED = (
    "elastic gear bodies beyond the mesh stiffness: gears are rigid discs on supports",
    "the shift of contact with load: the mesh stiffness follows from the mesh phase alone, where no finite-element"
    " tables are asked for",
)


def left_out(model: str, of_record: str = "") -> list[str]:
    """What the model leaves out, in phrases; `of_record`: the attribute `limits` of a record, which says more."""
    known = LUMPED if model == "lumped" else ELASTIC
    return [*known, *EVERYWHERE, *(part for part in of_record.splitlines() if part)]
