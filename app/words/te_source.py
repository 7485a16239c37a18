"""What a static transmission error holds: models differ by what they count as compliance."""

from __future__ import annotations

ELASTIC = (
    "The static TE is that of the elastic gears: teeth, fillets and the body from the hub circle outwards, which"
    " neighbouring tooth pairs share, with contact that shifts and stiffens under load. The lumped model counts tooth"
    " pairs as springs side by side and is stiffer where several carry, so that its TE swings more."
)
OF_LAWS = {
    "potential-energy": (
        "The static TE is force over mesh stiffness by the potential-energy law: tooth pairs are springs side by side,"
        " which know nothing of the gear body that they share nor of contact beyond its path. Finite elements are"
        " softer where several pairs carry, and their TE swings less: simulation.model = \"reduced\", or"
        " simulation.mesh_stiffness = \"finite-element\" in the lumped model."
    ),
    "rectangular": (
        "The static TE is force over the two mesh stiffnesses that the case gives, switched at the ends of single"
        " contact."
    ),
    "finite-element": "The static TE is that of the tables of finite elements that the lumped model runs on.",
}


def te_source(model: str, law: str) -> str:
    """One or two sentences. `model`: that of a result; `law`: simulation.mesh_stiffness of its case."""
    return OF_LAWS[law] if model == "lumped" else ELASTIC
