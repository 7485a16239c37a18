"""A rig of the non-linear lumped model as the reduced finite-element model has it: what is carried over, and what is
not.

Numbers of supports, housing, drive, load, friction, mesh correction, flanks and sensors are the same in both. Of two
the elements have another form: damping of the mesh, and a cracked tooth.
"""

from __future__ import annotations

from functools import lru_cache
from math import degrees, radians
from typing import NamedTuple

from gearbench.bench.refusals.effects import ELASTIC_KEYS, MOVING_KEYS, represents
from gearbench.geometry import GeometryError, profile
from gearbench.rig import Case, Crack, Damping, Gear, Material, Rig, Simulation
from gearbench.rig.neutral import effects_in, sound_gear

SIDES = ("driver", "driven")
MOST_RATIO = 0.49  # that a material may have
# Of a crack of which only the loss of stiffness is known: down into the rim, between along the tooth and across it, as
# bending drives cracks of teeth on solid rims.
DIRECTION = radians(60.0)
# Length in modules of the compliance that a crack adds over that of the sound tooth, of solid gears, about: where the
# search for it begins, and by what it goes on.
POWER = 0.6
CLOSE = 0.05  # of the loss, within which a crack stands for it: estimates of it are known to a third or so
TRIES = 6


class Carried(NamedTuple):
    """A case for the reduced model; `lacks`: keys of what it leaves out; `said`: sentences on what it has in another
    form."""

    case: Case
    lacks: tuple[str, ...]
    said: tuple[str, ...] = ()


def on_elements(case: Case, resonance: float, damped: bool = True) -> Carried:
    """The case for the reduced model. `damped`: whether the mesh's damping ratio counts, at the resonance [Hz] of what
    turns on the mesh, rather than the material's. Raises GeometryError for gears that cannot be meshed."""
    rig, lacks, said = case.rig, [], []
    for key in effects_in(rig):
        if key.startswith("rig.sensors.") or represents(key, (*ELASTIC_KEYS, *MOVING_KEYS)):
            continue
        if not key.endswith(".crack"):
            lacks.append(key)
    if "rig.damping.mesh_exponent" in lacks:
        rig = rig.model_copy(update={"damping": rig.damping.model_copy(update={"mesh_exponent": 0.0})})
    if rig.mesh.stiffness_drift:
        lacks.append("rig.mesh.stiffness_drift")
        rig = rig.model_copy(update={"mesh": rig.mesh.model_copy(update={"stiffness_drift": 0.0})})
    if damped:
        rig = rig.model_copy(update={"damping": damped_alike(rig.damping, resonance)})
    for side in SIDES:
        gear: Gear = getattr(rig, side)
        if gear.crack is None or not gear.crack.stiffness_loss:
            continue
        found = crack_of(gear, rig, case.simulation)
        rig = rig.model_copy(update={side: gear.model_copy(update={"crack": found})})
        if found is None or found.length is None:
            lacks.append(f"rig.{side}.crack")
            continue
        gears = {"driver": "the driver", "driven": "the driven gear"}
        said.append(
            f"a crack of {1e3 * found.length:.2g} mm, {degrees(DIRECTION):g} degrees to the centre line of tooth"
            f" {found.tooth} of {gears[side]}, loses as much stiffness by finite elements"
        )
    return Carried(case.model_copy(update={"rig": rig}), tuple(lacks), tuple(said))


def damped_alike(damping: Damping, resonance: float) -> Damping:
    """The damping with a material that damps the mesh as its own ratio does: flexibility of teeth that obeys u + beta
    u' = R(F) has the ratio pi f beta at f, as 2 zeta sqrt(k m) over k is beta at its own resonance."""
    return damping.model_copy(
        update={"material_ratio": min(damping.mesh_ratio, MOST_RATIO), "material_frequency": resonance}
    )


def mesh_damped_alike(damping: Damping, resonance: float) -> Damping:
    """The damping with a mesh of the ratio that the material has at its resonance [Hz]: the way back."""
    ratio = damping.material_ratio * resonance / damping.material_frequency
    return damping.model_copy(update={"mesh_ratio": min(ratio, MOST_RATIO)})


def crack_of(gear: Gear, rig: Rig, simulation: Simulation) -> Crack | None:
    """The crack in the mesh whose loss of stiffness is that of a gear's crack, to within `CLOSE`; the nearest one that
    fits where none has that, None where none fits."""
    assert gear.crack is not None
    plain = sound_gear(gear).model_copy(update={"mass": None, "inertia": None})
    size, modes = simulation.element_size, simulation.modes
    length = _length_of(plain, rig.material, gear.crack.stiffness_loss, size, modes)
    return None if length is None else Crack(tooth=gear.crack.tooth, length=length, direction=DIRECTION)


@lru_cache(maxsize=16)
def _length_of(gear: Gear, material: Material, loss: float, size: float | None, modes: int) -> float | None:
    """Length [m] of the crack in a sound gear that loses so much of a tooth's stiffness."""
    # Imported on use: few gears have a crack, and elements take seconds to load.
    from gearbench.bench.elastic.crack import stiffness_loss

    shape = profile(gear)

    def lost(length: float) -> float | None:
        cracked = gear.model_copy(update={"crack": Crack(tooth=0, length=length, direction=DIRECTION)})
        try:
            return stiffness_loss(cracked, shape, material, size, modes)
        except GeometryError:  # longer than the gear has room for
            return None

    wanted = loss / (1.0 - loss)
    length, best = gear.module * wanted**POWER, None
    for _ in range(TRIES):
        found = lost(length)
        if found is None or not found > 0.0:
            length *= 0.7 if found is None else 2.0
            continue
        off = abs(found - loss) / loss
        if best is None or off < best[1]:
            best = (length, off)
        if off <= CLOSE:
            break
        length *= (wanted * (1.0 - found) / found) ** POWER
    return best[0] if best else None
