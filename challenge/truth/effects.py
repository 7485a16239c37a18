"""The withheld effects: what each does to a rig's levels, where it sits, and what an answer says of its size.

Names and places are those of `rig.contract`; the foreign effects have places but no library entry.
Severities are drawn log-uniform from SEVERITY, in multiples of the sizes in `levels`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gearbench.challenge.truth.levels import (
    BACKLASH,
    CONTACT,
    CRACK,
    DAMPING,
    DELAY,
    DELAYED,
    DRIFT,
    ENCODER,
    EXPONENT,
    FRICTION,
    PITCH,
    PROFILE,
    RIPPLE,
    RIPPLE_ORDERS,
    RUNOUT,
    SUPPORT,
    Foreign,
    Levels,
    one_tooth,
    pitch_errors,
)

SEVERITY = (0.35, 1.6)
COUPLING = (900.0, 3000.0)  # [Hz] resonance of the rotor against the driver
SIDES = ("driver", "driven")
DRIFTING = ("mesh", "driver-support", "driven-support")

Parameters = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Drawn:
    """An effect put into a rig: its place, its size in units of severity 1, and its parameters with units."""

    levels: Levels
    place: str
    severity: float
    parameters: Parameters


Draw = Callable[[Levels, float, np.random.Generator], Drawn]


def _value(value: float, unit: str) -> dict[str, Any]:
    return {"value": float(value), "unit": unit}


def _on(pair: tuple[Any, Any], side: int, value: Any) -> tuple[Any, Any]:
    return (value, pair[1]) if side == 0 else (pair[0], value)


def _friction(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    size = FRICTION * severity
    return Drawn(replace(levels, friction=size), "mesh", severity, {"coefficient": _value(size, "1")})


def _eccentricity(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    side, size = int(rng.integers(2)), RUNOUT * severity
    parameters = {f"{SIDES[side]}.runout": _value(size * 1e6, "um")}
    return Drawn(replace(levels, runout=_on(levels.runout, side, size)), "mesh", severity, parameters)


def _pitch(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    sides = ((0,), (1,), (0, 1))[int(rng.integers(3))]
    pitch, parameters = levels.pitch, {}
    for side in sides:
        pitch = _on(pitch, side, pitch_errors(len(pitch[side]), PITCH * severity, rng))
        parameters[f"{SIDES[side]}.rms"] = _value(PITCH * severity * 1e6, "um")
    return Drawn(replace(levels, pitch=pitch), "mesh", severity, parameters)


def _crack(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    side, size = int(rng.integers(2)), CRACK * severity
    values = one_tooth(len(levels.crack[side]), size, rng)
    parameters = {
        f"{SIDES[side]}.stiffness_loss": _value(size, "1"),
        f"{SIDES[side]}.tooth": _value(int(values.argmax()), "1"),
    }
    return Drawn(replace(levels, crack=_on(levels.crack, side, values)), "mesh", severity, parameters)


def _coupling(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    # The severity's place in its range decides: the severest coupling is the softest.
    low, high = np.log(SEVERITY)
    part = (np.log(severity) - low) / (high - low)
    size = float(COUPLING[1] * (COUPLING[0] / COUPLING[1]) ** part)
    return Drawn(replace(levels, coupling_frequency=size), "drive", severity, {"resonance": _value(size, "Hz")})


def _bearing(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    side, size = int(rng.integers(2)), EXPONENT * severity
    levels = replace(levels, exponent=_on(levels.exponent, side, size))
    return Drawn(levels, f"{SIDES[side]}-support", severity, {f"{SIDES[side]}.exponent": _value(size, "1")})


def _delay(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    channel, size = int(rng.integers(len(DELAYED))), DELAY * severity
    a, b, c, d = (size if i == channel else value for i, value in enumerate(levels.delay))
    parameters = {f"{DELAYED[channel]}.delay": _value(size * 1e6, "us")}
    return Drawn(replace(levels, delay=(a, b, c, d)), "sensor", severity, parameters)


def _ripple(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    ripple = np.full(len(RIPPLE_ORDERS), RIPPLE * severity)
    parameters = {f"order_{order}.relative_amplitude": _value(RIPPLE * severity, "1") for order in RIPPLE_ORDERS}
    return Drawn(replace(levels, ripple=ripple), "drive", severity, parameters)


def _backlash(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    size = BACKLASH * severity
    return Drawn(replace(levels, backlash_more=size), "mesh", severity, {"more": _value(size * 1e6, "um")})


def _contact(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    size = CONTACT * severity
    return Drawn(replace(levels, contact=size), "mesh", severity, {"exponent": _value(size, "1")})


def _profile(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    # From peak to valley a slope is twice its amplitude, a bow once.
    size, kind = PROFILE * severity * float(rng.choice([-1.0, 1.0])), int(rng.integers(2))
    profile = ((0.5 * size, 0.0), (0.0, size))[kind]
    return Drawn(
        replace(levels, profile=profile), "mesh", severity, {"peak_to_valley": _value(abs(size) * 1e6, "um")}
    )


def _encoder(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    side, size = int(rng.integers(2)), ENCODER * severity
    parameters = {f"{SIDES[side]}.encoder_runout": _value(size * 1e6, "um")}
    return Drawn(replace(levels, encoder=_on(levels.encoder, side, size)), "sensor", severity, parameters)


def _drift(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    where, size = int(rng.integers(len(DRIFTING))), DRIFT * severity * float(rng.choice([-1.0, 1.0]))
    a, b, c = (size if i == where else 0.0 for i in range(3))
    of = "" if where == 0 else f"{SIDES[where - 1]}."
    parameters = {f"{of}stiffness_drift": _value(size, "1")}
    return Drawn(replace(levels, drift=(a, b, c)), DRIFTING[where], severity, parameters)


def _support(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    side, sense = int(rng.integers(2)), float(rng.choice([-1.0, 1.0]))
    factor = float(np.exp(sense * (SUPPORT[0] + SUPPORT[1] * severity)))
    levels = replace(levels, support=_on(levels.support, side, factor))
    parameters = {f"{SIDES[side]}.stiffness": _value(factor, "1")}
    return Drawn(levels, f"{SIDES[side]}-support", severity, parameters)


def _damping(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    factor = DAMPING[0] + DAMPING[1] * severity
    return Drawn(replace(levels, damping=factor), "mesh", severity, {"ratio": _value(factor, "1")})


# Draws of the effects by their names in the library.
EFFECTS: dict[str, Draw] = {
    "backlash": _backlash,
    "friction": _friction,
    "eccentricity": _eccentricity,
    "pitch-error": _pitch,
    "tooth-crack": _crack,
    "coupling": _coupling,
    "bearing-nonlinearity": _bearing,
    "sensor-delay": _delay,
    "torque-ripple": _ripple,
    "contact-nonlinearity": _contact,
    "profile-error": _profile,
    "encoder-runout": _encoder,
    "temperature-drift": _drift,
    "support-stiffness": _support,
    "mesh-damping": _damping,
}


def _foreign(levels: Levels, foreign: Foreign, place: str, parameters: Parameters) -> Drawn:
    return Drawn(replace(levels, foreign=foreign), place, 1.0, parameters)


def _slip(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    size = float(rng.uniform(0.5, 0.8))
    return _foreign(levels, Foreign(slip_part=size), "drive", {"limit_over_peak": _value(size, "1")})


def _tone(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    foreign = Foreign(
        tone=float(rng.uniform(0.01, 0.04)),
        tone_frequency=float(np.exp(rng.uniform(np.log(60.0), np.log(2500.0)))),
        tone_offset=float(rng.uniform(0.3, 0.5) * rng.choice([-1.0, 1.0])),
        tone_phase=float(rng.uniform(0, 2 * np.pi)),
    )
    parameters = {
        "relative_amplitude": _value(foreign.tone, "1"),
        "frequency": _value(foreign.tone_frequency, "Hz"),
    }
    return _foreign(levels, foreign, "drive", parameters)


def _filter(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    foreign = Foreign(
        filter_frequency=float(np.exp(rng.uniform(np.log(600.0), np.log(2500.0)))),
        filter_order=int(rng.integers(1, 3)),
        filter_acting=bool(rng.integers(2)),
    )
    return _foreign(levels, foreign, "drive", {"corner": _value(foreign.filter_frequency, "Hz")})


def _quadratic(levels: Levels, severity: float, rng: np.random.Generator) -> Drawn:
    size = float(np.exp(rng.uniform(np.log(0.6), np.log(2.5))))
    parameters = {"over_linear_at_30_mm_per_s": _value(size, "1")}
    return _foreign(levels, Foreign(damping_quadratic=size), "mesh", parameters)


# Draws of what no library holds; they have a range of their own and ignore the severity.
FOREIGN: dict[str, Draw] = {
    "slipping-coupling": _slip,
    "non-synchronous-torque": _tone,
    "torque-filter": _filter,
    "quadratic-mesh-damping": _quadratic,
}
