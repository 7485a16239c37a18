"""What the measuring chain does to the channels of a record."""

from __future__ import annotations

from typing import Any

from gearbench.rig.value import Value, quantity

_LONGEST_DELAY = 0.1  # s
_LARGEST_ANGLE = 1e-2  # rad


def _delay(channel: str) -> Any:
    return quantity(
        0.0, "us", ge=-_LONGEST_DELAY, le=_LONGEST_DELAY, doc=f"delay of channel {channel}; positive: it lags"
    )


def _gain(channel: str) -> Any:
    return quantity(1.0, gt=0.0, le=10.0, doc=f"sensitivity error of channel {channel}: shown over true value")


def _runout(gear: str) -> Any:
    return quantity(
        0.0, "urad", ge=0.0, le=_LARGEST_ANGLE, doc=f"amplitude of the error of angle_{gear}, once per revolution"
    )


def _runout_phase(gear: str) -> Any:
    return quantity(0.0, "deg", doc=f"rotation of the {gear} at which angle_{gear} exceeds the true angle most")


class Sensors(Value):
    """Errors of the channels, in the order in which they arise: zero and run-out of the encoders, delay, anti-alias
    filter, gain, white noise (rms per sample), quantisation."""

    delay_angle_driver: float = _delay("angle_driver")
    delay_angle_driven: float = _delay("angle_driven")
    delay_y_driver: float = _delay("y_driver")
    delay_y_driven: float = _delay("y_driven")
    delay_torque_driver: float = _delay("torque_driver")
    delay_torque_driven: float = _delay("torque_driven")
    noise_angle: float = quantity(0.0, "urad", ge=0.0, le=1.0, doc="noise of both angles, rms per sample")
    noise_displacement: float = quantity(0.0, "um", ge=0.0, le=1e-2, doc="noise of the displacements, rms per sample")
    noise_torque: float = quantity(0.0, "nm", ge=0.0, le=1e6, doc="noise of both torques, rms per sample")
    mesh_phase_zero: float = quantity(
        0.0, ge=-0.5, le=0.5, doc="mesh phase in cycles that both angles show where that of the gears is 0"
    )
    encoder_runout_driver: float = _runout("driver")
    encoder_runout_driver_phase: float = _runout_phase("driver")
    encoder_runout_driven: float = _runout("driven")
    encoder_runout_driven_phase: float = _runout_phase("driven")
    filter: float | None = quantity(
        None, "hz", gt=0.0, doc="corner of the anti-alias filter of all channels (Butterworth, order 8); absent: none"
    )
    gain_torque_driver: float = _gain("torque_driver")
    gain_torque_driven: float = _gain("torque_driven")
    quantisation_angle: float = quantity(
        0.0, "urad", ge=0.0, le=_LARGEST_ANGLE, doc="step of both angles, 2 pi over counts per turn; 0: none"
    )
    quantisation_displacement: float = quantity(
        0.0, "um", ge=0.0, le=1e-3, doc="step of the displacements; 0: none"
    )
    quantisation_torque: float = quantity(0.0, "nm", ge=0.0, le=1e6, doc="step of both torques; 0: none")
