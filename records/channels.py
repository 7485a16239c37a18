"""Channels of a record and their units.

A channel is named `<quantity>_<where>`, such as `torque_driver` or `acceleration_housing`; some
quantities stand alone (`dte`). The table is closed, so that a misspelt channel is an error and not a
silently ignored signal.
"""

from __future__ import annotations

import difflib

from gearbench.records.errors import RecordError

# Channels with a meaning of their own.
NAMED_UNITS: dict[str, str] = {
    "torque_driver": "N m",
    "torque_driven": "N m",
    "angle_driver": "rad",
    "angle_driven": "rad",
    "y_driver": "m",
    "y_driven": "m",
    "torque_coupling": "N m",
    "mesh_phase": "cycles",
    "dte": "m",
    "force": "N",
}

# Optional channels: any place may follow the prefix.
PREFIX_UNITS: dict[str, str] = {
    "x_": "m",
    "acceleration_": "m/s^2",
    "speed_": "rad/s",
    "support_force_": "N",
    "temperature_": "K",
    "tooth_force_": "N",
    "load_share_": "1",
}

# A record serves identification when it holds one of these sets; dte and force are computed from the second.
REDUCED_CHANNELS = frozenset({"dte", "force"})
RIG_CHANNELS = frozenset({"torque_driver", "angle_driver", "angle_driven"})


def unit_of_channel(name: str) -> str:
    """SI unit of a channel. Raises RecordError for a name that is no channel, with the nearest one."""
    if name in NAMED_UNITS:
        return NAMED_UNITS[name]
    for prefix, unit in PREFIX_UNITS.items():
        if name.startswith(prefix) and len(name) > len(prefix):
            return unit
    known = [*NAMED_UNITS, *(prefix + "*" for prefix in PREFIX_UNITS)]
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else f"; channels are {', '.join(known)}"
    raise RecordError(f"{name!r} is not a channel of a record{hint}")
