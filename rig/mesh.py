"""Corrections of the mesh force that the gears' geometry does not give: scale, shape, errors, friction."""

from __future__ import annotations

from math import hypot

from pydantic import model_validator

from gearbench.rig.checks import equally_long, items_within
from gearbench.rig.value import Value, quantity

_LARGEST_ERROR = 1e-3  # m
_LARGEST_COMPLIANCE = 1e-6  # m/N


class Friction(Value):
    """Coulomb friction between the flanks, regularised: mu tanh(v / transition_speed)."""

    coefficient: float = quantity(0.0, ge=0.0, le=1.0, doc="coefficient of friction between the flanks; 0: none")
    transition_speed: float = quantity(
        5e-3, "m_per_s", gt=0.0, le=10.0, doc="sliding speed v0 of mu tanh(v / v0) around the pitch point"
    )


class MeshCorrection(Value):
    """What multiplies the mesh force, and the errors common to all tooth pairs, as series in mesh phase.

    Stiffness: scale (1 + sum_n cos_n cos(2 pi n phase) + sin_n sin(2 pi n phase)); error (excess material
    of every pair): mean + sum_n cos_n cos(..) + sin_n sin(..). n = 1, 2, .. counts mesh orders. The drift is linear in
    time, as that of a rig that warms up.
    """

    stiffness_scale: float = quantity(1.0, gt=0.0, le=10.0, doc="factor on the mesh force")
    stiffness_drift: float = quantity(
        0.0, gt=-1.0, le=1.0, doc="relative change of the stiffness from the first to the last sample of a record"
    )
    stiffness_cos: tuple[float, ...] = quantity((), doc="relative cosine amplitudes at mesh orders 1, 2, ..")
    stiffness_sin: tuple[float, ...] = quantity((), doc="relative sine amplitudes at mesh orders 1, 2, ..")
    shared_compliance: float = quantity(
        0.0,
        "um_per_kn",
        ge=-_LARGEST_COMPLIANCE,
        le=_LARGEST_COMPLIANCE,
        doc="what bodies, rims and webs yield under all pairs together, beyond the teeth's own law; negative: less",
    )
    end_compliance: float = quantity(
        0.0,
        "um_per_kn",
        ge=-_LARGEST_COMPLIANCE,
        le=_LARGEST_COMPLIANCE,
        doc="c of what each pair yields more, c (x^2 - 1/3), by its place x on the path of contact, -1 to 1",
    )
    tilt_compliance: float = quantity(
        0.0,
        "um_per_kn",
        ge=-_LARGEST_COMPLIANCE,
        le=_LARGEST_COMPLIANCE,
        doc="c of what each pair yields more, c x, by its place x on the path, -1 where it begins to 1 where it ends",
    )
    exponent: float = quantity(
        0.0, gt=-0.5, le=1.0, doc="e of the force F (F / reference_force)^e, F being that of the teeth; 0: F"
    )
    reference_force: float = quantity(
        1000.0, "n", gt=0.0, le=1e9, doc="normal force at which the exponent leaves the mesh force as it is"
    )
    error_mean: float = quantity(
        0.0, "um", ge=-_LARGEST_ERROR, le=_LARGEST_ERROR, doc="excess material of every pair, mean"
    )
    error_cos: tuple[float, ...] = quantity((), "um", doc="cosine amplitudes of the excess at mesh orders 1, 2, ..")
    error_sin: tuple[float, ...] = quantity((), "um", doc="sine amplitudes of the excess at mesh orders 1, 2, ..")

    @model_validator(mode="after")
    def _series(self) -> MeshCorrection:
        equally_long(self, ("stiffness_cos", "stiffness_sin"))
        equally_long(self, ("error_cos", "error_sin"))
        for name in ("error_cos", "error_sin"):
            items_within(self, name, -_LARGEST_ERROR, _LARGEST_ERROR)
        swing = sum(hypot(c, s) for c, s in zip(self.stiffness_cos, self.stiffness_sin, strict=True))
        if swing >= 1.0:
            raise ValueError(
                f"the amplitudes of stiffness_cos and stiffness_sin add up to {swing:g}, which must be less than 1"
                " for the stiffness to stay positive"
            )
        return self
