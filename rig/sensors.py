"""What the measuring chain does to the channels of a record: delays and noise."""

from __future__ import annotations

from typing import Any

from gearbench.rig.value import Value, quantity

_LONGEST_DELAY = 0.1  # s


def _delay(channel: str) -> Any:
    return quantity(
        0.0, "us", ge=-_LONGEST_DELAY, le=_LONGEST_DELAY, doc=f"delay of channel {channel}; positive: it lags"
    )


class Sensors(Value):
    """Delays of single channels, and white noise (rms per sample) of each kind of channel."""

    delay_angle_driver: float = _delay("angle_driver")
    delay_angle_driven: float = _delay("angle_driven")
    delay_y_driver: float = _delay("y_driver")
    delay_y_driven: float = _delay("y_driven")
    delay_torque_driver: float = _delay("torque_driver")
    delay_torque_driven: float = _delay("torque_driven")
    noise_angle: float = quantity(0.0, "urad", ge=0.0, le=1.0, doc="noise of both angles, rms per sample")
    noise_displacement: float = quantity(0.0, "um", ge=0.0, le=1e-2, doc="noise of the displacements, rms per sample")
    noise_torque: float = quantity(0.0, "nm", ge=0.0, le=1e6, doc="noise of both torques, rms per sample")
