"""How the truth rigs are built: three families that share no structural choice of the mesh, and draws within each.

Development, calibration and test sets differ in seed and in structure: the shape of the pairs' stiffness, how mesh
damping depends on load, how friction turns over, what the housing does and what the sensors stand on. Inside a family
the true values of what the nominal rig gives with an uncertainty are drawn from it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.truth.teeth import Shape
from gearbench.rig import Case

Array = NDArray[np.float64]
Range = tuple[float, float]

LOOSE = (0.005, 0.10)  # compliance of a housing's mode over that of the supports, on rigs of a drawn size


@dataclass(frozen=True)
class Family:
    """Structural choices, each drawn uniformly from what is listed."""

    shape: Shape
    bow: Range  # loss of a pair's stiffness towards the ends of its path (not of shape "energy")
    exponent: Range  # of the pairs' force law, above 1
    damping_load: Range  # part of mesh damping that grows with the deflection
    damping_onset: Range  # [m]
    friction_shape: int
    housing: str  # "rocking", "shaking" or "oblique"
    sensors_on_housing: tuple[float, ...]
    side_ratio: Range  # stiffness of the supports across over along


FAMILIES: dict[str, Family] = {
    "development": Family(
        shape="parabola",
        bow=(0.2, 0.35),
        exponent=(0.03, 0.08),
        damping_load=(0.0, 0.25),
        damping_onset=(0.0, 0.2e-6),
        friction_shape=0,
        housing="rocking",
        sensors_on_housing=(0.0,),
        side_ratio=(3.0, 8.0),
    ),
    "calibration": Family(
        shape="cosine",
        bow=(0.15, 0.35),
        exponent=(0.05, 0.12),
        damping_load=(0.2, 0.6),
        damping_onset=(0.5e-6, 3e-6),
        friction_shape=1,
        housing="shaking",
        sensors_on_housing=(0.0,),
        side_ratio=(4.0, 10.0),
    ),
    "test": Family(
        shape="energy",
        bow=(0.0, 0.0),
        exponent=(0.03, 0.12),
        damping_load=(0.4, 1.0),
        damping_onset=(0.2e-6, 2e-6),
        friction_shape=1,
        housing="oblique",
        sensors_on_housing=(0.0, 1.0),
        side_ratio=(3.0, 10.0),
    ),
}


@dataclass(frozen=True)
class Structure:
    """One truth rig without effects. Pairs are driver, driven; fours are x_driver, y_driver, x_driven, y_driven."""

    family: str
    shape: Shape
    bow: float
    exponent: float
    stiffness_factor: float  # of the mean mesh stiffness
    damping_ratio: float  # of the mesh
    damping_load: float
    damping_onset: float
    friction_shape: int
    friction_speed: float
    profile: Array  # (4,) amplitudes [m] of slope, bow, wave's cosine and sine over the path of contact
    mass: Array  # (2,)
    inertia: Array  # (4,) rotor, driver, driven, load
    support: Array  # (4,)
    support_damping: Array  # (4,)
    mode_frequency: Array  # (2,) [Hz]
    mode_damping: Array  # (2,) ratio
    mode_part: Array  # (2,) compliance of the mode over that of the supports
    mode_shape: Array  # (2, 4)
    sensor_on_housing: float
    coupling_damping: float  # ratio
    shaft_frequency: float  # [Hz] of the driven gear against the load shaft
    shaft_damping: float  # ratio
    governor_frequency: float  # [Hz]
    governor_damping: float  # ratio


def family_named(name: str) -> Family:
    """The family of that name. Raises ChallengeError for an unknown one."""
    if name not in FAMILIES:
        raise ChallengeError(f"family {name!r} is unknown; families are {', '.join(FAMILIES)}")
    return FAMILIES[name]


def draw_structure(nominal: Case, name: str, rng: np.random.Generator) -> Structure:
    """One rig of a family around the nominal case, whose uncertain values are drawn within two standard deviations."""
    family, rig = family_named(name), nominal.rig
    u = rng.uniform

    def known(path: str, value: float, relative: float = 0.0) -> float:
        deviation = nominal.uncertainty.get(path, relative * value)
        return value + deviation * float(np.clip(rng.standard_normal(), -2.0, 2.0))

    one, two = rig.driver, rig.driven
    coupling = rig.drive.coupling
    assert one.mass and two.mass and one.inertia and two.inertia and coupling
    rotor = known("rig.drive.coupling.inertia", coupling.inertia)
    driver = known("rig.driver.inertia", one.inertia)
    reflected = (rotor + driver) * (two.teeth / one.teeth) ** 2
    along = [known(f"rig.support.{s}.stiffness", getattr(rig.support, s).stiffness) for s in ("driver", "driven")]
    damping = [known(f"rig.support.{s}.damping", getattr(rig.support, s).damping) for s in ("driver", "driven")]
    across = [u(*family.side_ratio) for _ in along]
    return Structure(
        family=name,
        shape=family.shape,
        bow=u(*family.bow),
        exponent=u(*family.exponent),
        stiffness_factor=known("rig.mesh.stiffness_scale", rig.mesh.stiffness_scale),
        damping_ratio=max(known("rig.damping.mesh_ratio", rig.damping.mesh_ratio), 0.2 * rig.damping.mesh_ratio),
        damping_load=u(*family.damping_load),
        damping_onset=u(*family.damping_onset),
        friction_shape=family.friction_shape,
        friction_speed=float(np.exp(u(np.log(2e-3), np.log(1e-2)))),
        profile=np.array([0.4e-6, 0.3e-6, 0.15e-6, 0.15e-6]) * rng.uniform(-1.0, 1.0, 4),
        mass=np.array([known("rig.driver.mass", one.mass), known("rig.driven.mass", two.mass)]),
        inertia=np.array([rotor, driver, known("rig.driven.inertia", two.inertia), reflected * u(20.0, 100.0)]),
        support=np.array([along[0] * across[0], along[0], along[1] * across[1], along[1]]),
        support_damping=np.array([damping[i // 2] * (u(1.0, 2.5) if i % 2 == 0 else 1.0) for i in range(4)]),
        mode_frequency=np.exp(rng.uniform(np.log(250.0), np.log(1400.0), 2)),
        mode_damping=rng.uniform(0.03, 0.06, 2),
        mode_part=rng.uniform(0.003, 0.01, 2),
        mode_shape=_housing(family.housing, rng),
        sensor_on_housing=float(rng.choice(family.sensors_on_housing)),
        coupling_damping=u(0.02, 0.05),
        shaft_frequency=u(8500.0, 11000.0),
        shaft_damping=u(0.02, 0.05),
        governor_frequency=u(4.0, 7.0),
        governor_damping=u(0.8, 1.0),
    )


def loosened(rig: Structure, rng: np.random.Generator) -> Structure:
    """The structure with a housing as soft as housings are, log-uniform in LOOSE."""
    low, high = np.log(LOOSE)
    return replace(rig, mode_part=np.exp(rng.uniform(low, high, 2)))


def _housing(kind: str, rng: np.random.Generator) -> Array:
    """Motion (2, 4) of the supports in the housing's two modes, the largest entry of each being 1."""
    if kind == "rocking":  # about an axis between the gears, and up and down
        shape = np.array([[0.0, -1.0, 0.0, rng.uniform(0.7, 1.3)], [0.0, 1.0, 0.0, rng.uniform(0.5, 1.0)]])
    elif kind == "shaking":  # sideways and up and down, with one end looser than the other
        shape = np.array([[1.0, 0.0, rng.uniform(0.6, 1.0), 0.0], [0.0, rng.uniform(0.1, 0.4), 0.0, 1.0]])
        shape[0, 1::2] = rng.uniform(-0.3, 0.3, 2)
    else:
        shape = rng.uniform(0.3, 1.0, (2, 4)) * rng.choice([-1.0, 1.0], (2, 4))
    return np.asarray(shape / np.abs(shape).max(axis=1, keepdims=True))
