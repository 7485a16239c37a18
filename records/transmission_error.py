"""Dynamic transmission error (DTE) and generalised force from the channels of a record.

Formulas: docs/physics.md, "Axes, signs, zeros".
"""

from __future__ import annotations

import warnings

import numpy as np
import xarray as xr

DIRECTIONS = ("tangential", "line-of-action")


class TransmissionError(ValueError):
    """A record from which DTE or force cannot be computed; the sentence names the channel or attribute."""


class AngleOnlyWarning(UserWarning):
    """The DTE leaves the motion of the gear centres out because the record does not hold it."""


def dte_of_channels(record: xr.Dataset) -> xr.DataArray:
    """DTE [m] (realisation, time) from angles and displacements, whatever the record holds as `dte`.

    rb1 theta1 - rb2 theta2 + (y1 - y2) cos(alpha_w) + (x1 - x2) sin(alpha_w); with supports along the line
    of action the factor of y is 1 and there is no x term. Without y channels the DTE holds the angles only:
    its attribute `angle_only` is then 1 and an AngleOnlyWarning is issued. Raises TransmissionError where
    something is missing.
    """
    angles = [_channel(record, f"angle_{gear}", "dte") for gear in ("driver", "driven")]
    radii = [_number(record, f"base_radius_{gear}", "dte") for gear in ("driver", "driven")]
    result = radii[0] * angles[0] - radii[1] * angles[1]
    attributes = {"units": "m", "angle_only": 0}
    present = [name for name in ("y_driver", "y_driven") if name in record]
    if not present:
        attributes["angle_only"] = 1
        warnings.warn(
            "the record has no y_driver and y_driven: its dte holds the angles only and misses the motion of the"
            " gear centres, which biases what is identified from it",
            AngleOnlyWarning,
            stacklevel=2,
        )
    else:
        direction = str(record.attrs.get("support_direction", "tangential"))
        if direction not in DIRECTIONS:
            raise TransmissionError(
                f"attribute support_direction = {direction!r} must be one of {', '.join(DIRECTIONS)}"
            )
        along = direction == "line-of-action"
        angle = 0.0 if along else _number(record, "working_pressure_angle", "dte")
        result = result + np.cos(angle) * _difference(record, "y")
        if not along and ("x_driver" in record or "x_driven" in record):
            result = result + np.sin(angle) * _difference(record, "x")
    result.attrs.update(attributes)
    return result.rename("dte")


def force_of_torques(record: xr.Dataset) -> xr.DataArray:
    """Generalised force F [N] (realisation, time) from the torques, whatever the record holds as `force`.

    Driven speed prescribed (driven_boundary "speed"): T1 / rb1. Both gears free ("torque"): m_e (rb1 T1 /
    J1 + rb2 T2 / J2) with m_e = J1 J2 / (J1 rb2^2 + J2 rb1^2), T2 positive against the driven rotation.
    Raises TransmissionError for other boundaries (shaft torque is not gear torque while a coupling is
    unmodelled) and where something is missing.
    """
    torque = _channel(record, "torque_driver", "force")
    radius = _number(record, "base_radius_driver", "force")
    if "driven_boundary" not in record.attrs:
        raise TransmissionError("the record lacks attribute driven_boundary, which force needs")
    boundary = str(record.attrs["driven_boundary"])
    if boundary == "speed":
        result = torque / radius
    elif boundary == "torque":
        torque_driven = _channel(record, "torque_driven", "force")
        radius_driven = _number(record, "base_radius_driven", "force")
        inertia = _number(record, "inertia_driver", "force")
        inertia_driven = _number(record, "inertia_driven", "force")
        mass = inertia * inertia_driven / (inertia * radius_driven**2 + inertia_driven * radius**2)
        result = mass * (radius * torque / inertia + radius_driven * torque_driven / inertia_driven)
    else:
        raise TransmissionError(
            f"attribute driven_boundary = {boundary!r}: the force on the mesh follows from the torques for 'speed' and"
            " 'torque' only; behind a coupling the shaft torque is not the gear torque"
        )
    result.attrs["units"] = "N"
    return result.rename("force")


def _channel(record: xr.Dataset, name: str, purpose: str) -> xr.DataArray:
    if name not in record:
        raise TransmissionError(f"the record lacks channel {name}, which {purpose} needs")
    return record[name]


def _difference(record: xr.Dataset, axis: str) -> xr.DataArray:
    first, second = (_channel(record, f"{axis}_{gear}", "dte") for gear in ("driver", "driven"))
    return first - second


def _number(record: xr.Dataset, name: str, purpose: str) -> float:
    if name not in record.attrs:
        raise TransmissionError(f"the record lacks attribute {name}, which {purpose} needs")
    value = float(record.attrs[name])
    if not np.isfinite(value) or value <= 0:
        raise TransmissionError(f"attribute {name} = {value:g} must be positive")
    return value
