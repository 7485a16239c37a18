"""What `mesh` accepts: kinds of file, and options that belong together."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gearbench.shell.failure import InputError

if TYPE_CHECKING:
    from gearbench.geometry.mesh.sector import Element
    from gearbench.rig import Rig

SUFFIXES = (".msh", ".vtu", ".inp", ".dxf", ".step")
KNOWN = ".msh, .vtu, .inp, .dxf or .step"


def check_mesh_options(
    out: Path,
    *,
    dimension: int,
    layers: int | None,
    element: str | None,
    gear: str,
    contact: Mapping[str, float | None],
) -> None:
    """Refuse a kind of file that does not exist, and options that it has no use for. Raises InputError.

    `contact`: the options of the contact model with their values, None where not given.
    """
    from gearbench.geometry.mesh.sweep import MOST_LAYERS

    if out.suffix not in SUFFIXES:
        raise InputError(f"--out {out} has no known mesh format: the suffix must be {KNOWN}")
    if dimension not in (2, 3):
        raise InputError(f"--dimension {dimension} must be 2 or 3")
    solid = dimension == 3
    in_contact = out.suffix == ".inp" and not solid
    drawing = out.suffix in (".dxf", ".step")
    given = [name for name, value in contact.items() if value is not None]
    if given and not in_contact:
        raise InputError(f"{given[0]} belongs to the contact model of the pair: --out must end in .inp, --dimension 2")
    if in_contact and gear != "both":
        raise InputError(f"--gear {gear} has no mate to touch: the contact model in {out.name} needs both gears")
    if in_contact and element not in (None, "triangle"):
        raise InputError(f"--element {element} cannot be used in {out.name}: the contact model has triangles")
    if drawing and (solid or element not in (None, "triangle")):
        raise InputError(f"--out {out.name} is a drawing without elements: leave out --dimension and --element")
    if layers is not None and not solid:
        raise InputError(f"--layers {layers} needs --dimension 3")
    if layers is not None and not 1 <= layers <= MOST_LAYERS:
        raise InputError(f"--layers {layers} must lie between 1 and {MOST_LAYERS}")


def check_crack(rig: Rig, gear: str, out: Path, option: Element | None = None, setting: Element = "triangle") -> None:
    """Refuse a crack with a length in a drawing and among quadrilaterals, which `--element` (`option`) or else the
    case's simulation.element (`setting`) asks for. Raises InputError or GeometryError."""
    from gearbench.geometry.mesh.sector import refuse_crack

    for name in ("driver", "driven"):
        one = getattr(rig, name)
        if gear not in ("both", name) or one.crack is None or not one.crack.meshed:
            continue
        if out.suffix in (".dxf", ".step"):
            raise InputError(f"rig.{name}.crack cannot be drawn in {out.name}: .msh, .vtu and solids in .inp show it")
        key = "--element" if option else "simulation.element"
        refuse_crack(one, option or setting, f"rig.{name}", key)
