"""How much of every effect a truth rig has: background levels of all, one or two at full size, or a foreign one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RIPPLE_ORDERS = (6, 12, 18, 24)
DELAYED = ("angle_driver", "angle_driven", "y_driver", "y_driven")
# What counts as severity 1 of each effect (benchmarks/diagnosis_log.md).
FRICTION = 0.06
RUNOUT = 10e-6
PITCH = 3e-6
CRACK = 0.35
EXPONENT = 0.35
DELAY = 50e-6
RIPPLE = 0.006  # of the mean torque, at each order
BACKLASH = 80e-6  # transverse, at the reference circles
CONTACT = 0.35  # exponent of the pairs' force law beyond the structure's
PROFILE = 8e-6  # of the flanks over the path of contact, from peak to valley
ENCODER = 5e-6  # amplitude along the base circle
DRIFT = 0.06  # of a stiffness over a record
# Logarithm of a support's stiffness over the nominal one, either way: part that all have, and part that grows.
SUPPORT = (0.3, 0.4)
# Damping ratio of the mesh over the nominal one, likewise.
DAMPING = (3.0, 1.5)
BACKGROUND = (0.05, 0.12)  # of severity 1
RIGID_COUPLING = (7500.0, 11000.0)  # [Hz] background of the coupling's resonance


@dataclass(frozen=True)
class Foreign:
    """Effects that no library holds; the defaults are none."""

    slip_part: float = 0.0  # torque limit of the coupling is mean + part x peak of the first condition; 0: none
    tone: float = 0.0  # amplitude over the mean torque
    tone_frequency: float = 0.0  # [Hz]
    tone_offset: float = 0.0  # from the nearest line, in lines
    tone_phase: float = 0.0
    filter_frequency: float = 0.0  # [Hz]; 0: none
    filter_order: int = 1
    filter_acting: bool = False  # the torque that acts is filtered, not the recorded one
    damping_quadratic: float = 0.0  # over the linear damping, at a rate of 30 mm/s


@dataclass(frozen=True)
class Levels:
    """Sizes of all effects of one rig, SI. Pairs are driver, driven."""

    friction: float
    runout: tuple[float, float]
    runout_phase: tuple[float, float]
    pitch: tuple[Array, Array]  # (z1,), (z2,) excess [m], mean 0
    crack: tuple[Array, Array]  # (z1,), (z2,) loss of bending stiffness
    coupling_frequency: float  # [Hz] of the rotor against the driver
    exponent: tuple[float, float]
    delay: tuple[float, float, float, float]  # of DELAYED [s]
    ripple: Array  # (orders,) over the mean torque
    ripple_phase: Array
    backlash_more: float  # [m] transverse, at the reference circles
    encoder: tuple[float, float] = (0.0, 0.0)  # [m] along the base circles
    encoder_phase: tuple[float, float] = (0.0, 0.0)
    contact: float = 0.0  # exponent beyond the structure's
    profile: tuple[float, float] = (0.0, 0.0)  # [m] slope and bow beyond the structure's
    support: tuple[float, float] = (0.0, 0.0)  # stiffness over the nominal one; 0: as the structure has it
    damping: float = 0.0  # ratio of the mesh likewise
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)  # mesh, driver's support, driven support over a record
    foreign: Foreign = field(default_factory=Foreign)


def background(teeth: tuple[int, int], rng: np.random.Generator) -> Levels:
    """What a good rig has of everything: 5 to 12 % of severity 1, each drawn for itself."""

    def level(size: float) -> float:
        return float(size * rng.uniform(*BACKGROUND))

    def sign() -> float:
        return float(rng.choice([-1.0, 1.0]))

    return Levels(
        friction=level(FRICTION),
        runout=(level(RUNOUT), level(RUNOUT)),
        runout_phase=(float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(0, 2 * np.pi))),
        pitch=(pitch_errors(teeth[0], level(PITCH), rng), pitch_errors(teeth[1], level(PITCH), rng)),
        crack=(one_tooth(teeth[0], level(CRACK), rng), one_tooth(teeth[1], level(CRACK), rng)),
        coupling_frequency=float(rng.uniform(*RIGID_COUPLING)),
        exponent=(level(EXPONENT), level(EXPONENT)),
        delay=(sign() * level(DELAY), sign() * level(DELAY), sign() * level(DELAY), sign() * level(DELAY)),
        ripple=np.array([level(RIPPLE) for _ in RIPPLE_ORDERS]),
        ripple_phase=rng.uniform(0, 2 * np.pi, len(RIPPLE_ORDERS)),
        backlash_more=sign() * level(BACKLASH),
        # What came later draws last: a seed keeps its rigs.
        encoder=(level(ENCODER), level(ENCODER)),
        encoder_phase=(float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(0, 2 * np.pi))),
    )


def pitch_errors(teeth: int, rms: float, rng: np.random.Generator) -> Array:
    """Random excess (teeth,) [m] of mean 0 and exactly this rms."""
    values = rng.standard_normal(teeth)
    values -= values.mean()
    return np.asarray(values * rms / np.sqrt(np.mean(values**2)))


def one_tooth(teeth: int, loss: float, rng: np.random.Generator) -> Array:
    """Losses (teeth,) of bending stiffness: one tooth's."""
    values = np.zeros(teeth)
    values[rng.integers(teeth)] = loss
    return values
