"""DTE and force of a record against docs/physics.md, "Axes, signs, zeros", written out by hand."""

import warnings
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr

from gearbench.identification.spectra.transmission_error import AngleOnlyWarning, TransmissionError, dte, force

RB1, RB2, J1, J2, ALPHA = 0.03, 0.05, 4e-3, 9e-3, 0.4


def record(*, drop: tuple[str, ...] = (), **attributes: object) -> xr.Dataset:
    rng = np.random.default_rng(3)
    names = ["torque_driver", "torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven"]
    data = {name: (("realisation", "time"), rng.standard_normal((2, 5))) for name in names if name not in drop}
    attrs = {
        "base_radius_driver": RB1,
        "base_radius_driven": RB2,
        "inertia_driver": J1,
        "inertia_driven": J2,
        "working_pressure_angle": ALPHA,
        "support_direction": "tangential",
        "driven_boundary": "speed",
        **attributes,
    }
    return xr.Dataset(data, attrs={k: v for k, v in attrs.items() if k not in drop})


def test_dte_with_tangential_supports() -> None:
    r = record()
    wanted = RB1 * r.angle_driver - RB2 * r.angle_driven + (r.y_driver - r.y_driven) * np.cos(ALPHA)
    assert dte(r).values == pytest.approx(wanted.values, rel=1e-12)
    assert dte(r).attrs == {"units": "m", "angle_only": 0}


def test_dte_with_supports_along_the_line_of_action_ignores_angle_and_x() -> None:
    r = record(support_direction="line-of-action", drop=("working_pressure_angle",))
    r["x_driver"] = r["x_driven"] = 3 * r["y_driver"]
    wanted = RB1 * r.angle_driver - RB2 * r.angle_driven + r.y_driver - r.y_driven
    assert dte(r).values == pytest.approx(wanted.values, rel=1e-12)


def test_dte_takes_x_where_it_is() -> None:
    r = record()
    r["x_driver"], r["x_driven"] = 3 * r["y_driver"], 2 * r["y_driven"]
    extra = (3 * r.y_driver - 2 * r.y_driven) * np.sin(ALPHA)
    assert (dte(r) - dte(r.drop_vars(["x_driver", "x_driven"]))).values == pytest.approx(extra.values, rel=1e-9)


def test_rigid_rotation_of_both_gears_is_no_transmission_error() -> None:
    r = record()
    turn = np.linspace(0, 40, 5)
    r["angle_driver"] = r["angle_driver"] * 0 + turn
    r["angle_driven"] = r["angle_driven"] * 0 + turn * RB1 / RB2
    r["y_driver"] = r["y_driven"] = r["y_driver"] * 0
    assert np.abs(dte(r).values).max() < 1e-15


def test_force_with_prescribed_speed() -> None:
    r = record()
    assert force(r).values == pytest.approx(r.torque_driver.values / RB1, rel=1e-12)


def test_force_with_both_gears_free_is_that_of_the_relative_motion() -> None:
    r = record(driven_boundary="torque")
    # Free gears under F_m = 0: dte'' = rb1 T1/J1 + rb2 T2/J2, and m_e is the mass that F accelerates by it.
    acceleration = RB1 * r.torque_driver / J1 + RB2 * r.torque_driven / J2
    mass = 1.0 / (RB1**2 / J1 + RB2**2 / J2)
    assert force(r).values == pytest.approx((mass * acceleration).values, rel=1e-12)


def test_balanced_torques_agree_in_both_definitions() -> None:
    r = record(driven_boundary="torque")
    r["torque_driven"] = r["torque_driver"] * RB2 / RB1
    assert force(r).values == pytest.approx(r.torque_driver.values / RB1, rel=1e-12)


def test_given_dte_and_force_pass_through() -> None:
    r = record(drop=("angle_driver", "torque_driver"))
    r["dte"] = r["force"] = r["y_driver"] * 7
    assert dte(r).identical(r["dte"])
    assert force(r).identical(r["force"])


def test_angle_only_is_marked_and_warned_of() -> None:
    r = record(drop=("y_driver", "y_driven"))
    with pytest.warns(AngleOnlyWarning, match="angles only"):
        result = dte(r)
    assert result.attrs["angle_only"] == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert dte(record()).attrs["angle_only"] == 0


@pytest.mark.parametrize(
    ("quantity", "kwargs", "words"),
    [
        (dte, {"drop": ("angle_driven",)}, "lacks channel angle_driven, which dte needs"),
        (dte, {"drop": ("y_driven",)}, "lacks channel y_driven"),
        (dte, {"drop": ("base_radius_driven",)}, "lacks attribute base_radius_driven"),
        (dte, {"drop": ("working_pressure_angle",)}, "lacks attribute working_pressure_angle"),
        (dte, {"support_direction": "radial"}, "'radial' must be one of tangential, line-of-action"),
        (dte, {"base_radius_driver": -1.0}, "base_radius_driver = -1 must be positive"),
        (force, {"drop": ("torque_driver",)}, "lacks channel torque_driver, which force needs"),
        (force, {"drop": ("driven_boundary",)}, "driven_boundary"),
        (force, {"driven_boundary": "inertia"}, "'inertia'.*shaft torque is not the gear torque"),
        (force, {"driven_boundary": "torque", "drop": ("torque_driven",)}, "torque_driven"),
        (force, {"driven_boundary": "torque", "drop": ("inertia_driven",)}, "inertia_driven"),
    ],
)
def test_what_is_missing_is_named(quantity: Callable, kwargs: dict, words: str) -> None:
    with pytest.raises(TransmissionError, match=words):
        quantity(record(**kwargs))
