"""Root stress over the mesh cycle by finite elements, for `static.nc`, and the load case of ISO 6336-3."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig
from gearbench.fem.gear.store import cached, key_for
from gearbench.fem.stress.fields import elastic_gear
from gearbench.fem.stress.loaded import PairLoad, pair_loads
from gearbench.fem.stress.root import RootKernel, peak, root_kernel, root_stress
from gearbench.geometry.mesh.element_size import default_size
from gearbench.rig import Gear, Material, Rig, sound_gear

Array = NDArray[np.float64]

GEARS = ("driver", "driven")
SHARP = "a rack tip of radius 0 leaves a sharp root, whose stress grows without end on finer meshes"
CRACK = "root stress is not computed for a cracked gear"


def stored_root(gear: Gear, material: Material, element_size: float | None = None) -> RootKernel:
    """`root_kernel` of the sound gear, from disk where it has been solved before."""
    bare = sound_gear(gear).model_copy(update={"mass": None, "inertia": None, "bore_radius": 0.0})
    key = key_for("root", {"gear": bare, "material": material, "element_size": element_size})

    def make() -> dict[str, Any]:
        kernel = root_kernel(elastic_gear(bare, material, element_size), bare.face_width)
        return {one.name: np.asarray(getattr(kernel, one.name)) for one in fields(RootKernel)}

    found: dict[str, Any] = dict(cached(key, make))
    return RootKernel(**found | {"last": int(found["last"]), "width": float(found["width"])})


def why_not(rig: Rig) -> str:
    """Why a rig has no root stress; empty if it has."""
    gears = rig.driver, rig.driven
    if any(gear.crack is not None for gear in gears):
        return CRACK
    return SHARP if any(gear.rack_tip_radius == 0.0 for gear in gears) else ""


def with_root_stress(elastic: ElasticRig, result: xr.Dataset, element_size: float | None = None) -> xr.Dataset:
    """A static result of this rig with root stress; without, and with a note as attribute, where `why_not` says so.

    element_size [m]: of the fillets (None: module / 12, the coarsest).
    For each gear: root_stress_NAME (load, phase, root): largest tension along the working root of the tooth
    root_stress_tooth (root,); of the most loaded tooth root_stress_peak_NAME (load,), root_stress_radius_NAME,
    root_stress_angle_NAME (tangent to tooth axis), root_stress_phase_NAME (since the tooth's contact at the pitch
    point); root_stress_outer_NAME (load,): the mean torque on one tooth alone, at the outer point of single contact.
    """
    if reason := why_not(elastic.rig):
        return result.assign_attrs(root_stress_note=reason)
    rig = elastic.rig
    kernels = [stored_root(gear, rig.material, _fine(gear, element_size)) for gear in (rig.driver, rig.driven)]
    phases, te = result["phase"].values, result["transmission_error"].values
    loads = [[pair_loads(elastic.law, float(x), float(d)) for x, d in zip(phases, row, strict=True)] for row in te]
    teeth = _teeth(loads)
    variables: dict[str, Any] = {"root_stress_tooth": ("root", teeth, {"long_name": "driver tooth of the pair"})}
    shape = (*te.shape, len(teeth))
    for number, name in enumerate(GEARS):
        kernel, count = kernels[number], (rig.driver, rig.driven)[number].teeth
        found = np.zeros((*shape, 3))
        for i, j in np.ndindex(*te.shape):
            for k, tooth in enumerate(teeth):
                found[i, j, k] = peak(kernel, root_stress(kernel, loads[i][j], count, number, int(tooth)))
        variables |= _variables(name, found, phases[:, None] - teeth)
        torque = result["torque"].values.mean(axis=1)
        outer = outer_stress(elastic, kernel, number) * torque
        variables[f"root_stress_outer_{name}"] = ("load", outer, {"units": "Pa"})
    return result.assign(variables)


def _fine(gear: Gear, element_size: float | None) -> float | None:
    """Element size for fillets: None where the asked one is coarser than the default."""
    return element_size if element_size is not None and element_size < default_size(gear.module) else None


def _teeth(loads: list[list[list[PairLoad]]]) -> NDArray[np.int64]:
    """Driver teeth that carry at some phase and load, and one more at either end: they feel their neighbours."""
    used = [one.tooth for row in loads for pairs in row for one in pairs] or [0]
    return np.arange(min(used) - 1, max(used) + 2)


def _variables(name: str, found: Array, phase: Array) -> dict[str, Any]:
    """Stress, radius and angle (load, phase, root, 3) of one gear as variables; phase (phase, root) of each tooth."""
    flat = found.reshape(len(found), -1, 3)
    best = flat[:, :, 0].argmax(axis=1)
    most = flat[np.arange(len(flat)), best]
    return {
        f"root_stress_{name}": (("load", "phase", "root"), found[..., 0], {"units": "Pa"}),
        f"root_stress_peak_{name}": ("load", most[:, 0], {"units": "Pa"}),
        f"root_stress_radius_{name}": ("load", most[:, 1], {"units": "m"}),
        f"root_stress_angle_{name}": ("load", most[:, 2], {"units": "rad"}),
        f"root_stress_phase_{name}": ("load", phase.ravel()[best], {"units": "cycles"}),
    }


def outer_stress(elastic: ElasticRig, kernel: RootKernel, number: int) -> float:
    """Largest tension [Pa] per driver torque [N m] of one tooth alone, loaded at the outer point of single contact."""
    meshing = elastic.pair
    tooth, rolls = (
        (meshing.driver, meshing.active_driver) if number == 0 else (meshing.driven, meshing.active_driven)
    )
    rho = min(rolls[0] + meshing.base_pitch, tooth.rho_end)
    force = 1.0 / meshing.driver.base_radius
    stress = force * tooth.base_radius / kernel.width * kernel.of_moment(0, rho**2 / (2 * tooth.base_radius), 0)
    return peak(kernel, stress)[0]
