"""Condensed gears, and other arrays, on disk under a hash of all that they depend on, our sources included."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields
from functools import lru_cache
from importlib.metadata import version
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.fem.gear.body import CondensedGear, condense
from gearbench.fem.gear.crack import CrackedTooth
from gearbench.fem.limits import rounded
from gearbench.files import write_whole
from gearbench.geometry.mesh.sector import Element
from gearbench.kernels.folders import cache_folder
from gearbench.rig import Gear, Material, sound_gear
from gearbench.rig.value import Value

Arrays = Mapping[str, Any]  # of numpy arrays

SOURCES = ("gearbench.geometry", "gearbench.fem", "gearbench.kernels")
_COUNT = "number of arrays"
LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh")


@lru_cache(maxsize=1)
def code_digest() -> str:
    """Hash of the sources and library versions that a condensed gear depends on."""
    digest = hashlib.sha256()
    for package in SOURCES:
        spec = find_spec(package)
        for folder in (spec.submodule_search_locations or []) if spec else []:
            for source in sorted(Path(folder).rglob("*.py")):
                digest.update(source.read_bytes())
    for library in LIBRARIES:
        digest.update(f"{library} {version(library)}".encode())
    return digest.hexdigest()


def key_for(kind: str, values: Mapping[str, Value | float | int | str | None]) -> str:
    """Name of a cache entry: hash of the code and of the values it is made from."""
    plain = {k: v.model_dump(mode="json") if isinstance(v, Value) else v for k, v in values.items()}
    text = json.dumps([kind, code_digest(), plain], sort_keys=True)
    return f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:32]}"


def cached(key: str, make: Callable[[], Arrays]) -> Arrays:
    """Arrays stored under `key`, made and stored where absent; a damaged entry is made again.

    A cache that cannot be written costs time, never the result.
    """
    path = cache_folder() / f"{key}.npz"
    try:
        return _stored(path)
    except Exception:  # reading a damaged archive raises anything
        arrays = make()
    content = {**arrays, _COUNT: np.asarray(len(arrays))}
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, lambda temporary: np.savez(temporary, allow_pickle=False, **content))
    return arrays


def _stored(path: Path) -> Arrays:
    """The arrays in a file of numpy. Each member is read whole, so that its checksum covers its description too."""
    with zipfile.ZipFile(path) as archive:
        members = {name.removesuffix(".npy"): BytesIO(archive.read(name)) for name in archive.namelist()}
    arrays = {name: np.lib.format.read_array(member, allow_pickle=False) for name, member in members.items()}
    # A damaged directory of the archive may hide members.
    if arrays.pop(_COUNT) != len(arrays):
        raise EOFError(f"{path} lacks arrays")
    return arrays


def stored_gear(
    gear: Gear,
    material: Material,
    element_size: float | None = None,
    modes: int = 8,
    element: Element = "triangle",
) -> CondensedGear:
    """`condense(...)`, from disk where it has been done before."""
    key = gear_key(gear, material, element_size, modes, element)
    arrays = cached(key, lambda: _arrays(condense(gear, material, element_size, modes, element)))
    scalars = {"teeth": int, "last": int, "unknowns": int, "face_width": float}
    values: dict[str, Any] = {name: scalars[name](v) if name in scalars else v for name, v in arrays.items()}
    extra = values.pop("extra", None)
    if extra is not None and gear.crack is not None:
        values["crack"] = CrackedTooth(gear.crack.tooth, extra)
    return CondensedGear(**values)


def _arrays(gear: CondensedGear) -> Arrays:
    """What is stored of a condensed gear."""
    arrays = {f.name: np.asarray(getattr(gear, f.name)) for f in fields(gear) if f.name != "crack"}
    return arrays if gear.crack is None else arrays | {"extra": gear.crack.extra}


def gear_key(
    gear: Gear, material: Material, element_size: float | None, modes: int, element: Element = "triangle"
) -> str:
    """Cache entry of a condensed gear; totals of mass and inertia, tooth errors and the number of a cracked tooth do
    not enter the condensation."""
    bare = sound_gear(rounded(gear)).model_copy(update={"mass": None, "inertia": None, "bore_radius": 0.0})
    if gear.crack is not None and gear.crack.meshed:
        bare = bare.model_copy(update={"crack": gear.crack.model_copy(update={"tooth": 0})})
    mesh: dict[str, float | str | None] = {"element_size": element_size, "element": element}
    return key_for("gear", {"gear": bare, "material": material, "modes": modes, **mesh})
