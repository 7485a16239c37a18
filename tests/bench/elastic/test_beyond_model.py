"""Loads that take the flanks beyond what is modelled on the way: the record is finished, and says so."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearbench.bench import simulate
from gearbench.bench.elastic.rig import elastic_rig
from gearbench.bench.elastic.run import rest_of
from gearbench.bench.sweep import Look, _warnings
from gearbench.cases import case_path
from gearbench.fem.contact.curve import curve_at, largest_force
from gearbench.fem.contact.static import ContactError
from gearbench.fem.motion.start import initial_state
from gearbench.geometry import pair
from gearbench.rig import Case, read_case

SHORT = [
    "experiment.mesh_frequency_hz=256",
    "experiment.samples_per_period=1024",
    "experiment.periods=1",
    "experiment.multisine.band_hz=[8,1500]",
    "experiment.torque_mean_nm=1500",
    "rig.support.stiffness_n_per_m=1e9",
    "rig.support.damping_n_s_per_m=1e5",
    "simulation.outputs=teeth",
]


def case(amplitude: float) -> Case:
    return read_case(case_path("quick_fe"), [*SHORT, f"experiment.multisine.amplitude_nm={amplitude}"])


@lru_cache
def record(amplitude: float) -> xr.Dataset:
    return simulate(case(amplitude))


def test_an_overload_on_the_way_is_finished_balanced_and_told() -> None:
    """Where it is does not depend on how the record is cut; the teeth carry the torque on the average."""
    found = record(1000.0)
    assert all(np.isfinite(values.values).all() for values in found.data_vars.values())
    names = ("leaving", "middle", "entering")
    pressed = sum(found[f"tooth_force_{name}"].values[0] for name in names) - found["tooth_force_back"].values[0]
    torque = found["torque_driver"].values[0]
    moment = pressed * pair(case(1000.0).rig).driver.base_radius
    assert abs((moment - torque).mean()) < 5e-3 * torque.mean()
    many = int(found.attrs["beyond_model_samples"])
    sentence = str(found.attrs["warnings"]).splitlines()[0]
    assert 0 < many < 200 and sentence.startswith(f"in {many} of 1024 samples, first at t = ")
    first = float(sentence.split("t = ")[1].split(" s,")[0])
    time, dte = found["time"].values, found["dte"].values[0]
    there = int(np.argmin(np.abs(time - first)))
    # Flanks are modelled up to a separation of 0.05 modules: no smaller DTE takes an edge further.
    assert dte[there] > 0.05 * 2e-3


def test_a_load_within_says_nothing() -> None:
    found = record(100.0)
    assert found.attrs["beyond_model_samples"] == 0 and "beyond" not in str(found.attrs.get("warnings", ""))


def test_a_sweep_tells_at_how_many_speeds() -> None:
    look = Look(0.0, 0.0, 1.0, 0.0, 0.0, 0.0, False, np.zeros(1))
    assert _warnings([look, look]) == ""
    assert _warnings([look, look._replace(beyond_model=0.1)]).startswith("at 1 of 2 speeds teeth overlap beyond")


def test_a_curve_goes_on_beyond_its_loads() -> None:
    """Smoothly, as a half-plane's approach does, whose share per force falls linearly in ln F; ever more approach."""
    curve = elastic_rig(case(1.0).rig, case(1.0).simulation).law.curves.driver
    most = largest_force(curve)
    xi = float(curve.xi[len(curve.xi) // 3])
    below, above = (np.array(curve_at(curve, xi, most * (1 + sign * 1e-9))) for sign in (-1, 1))
    np.testing.assert_allclose(above, below, rtol=1e-7)
    forces = most * np.geomspace(1.0, 30.0, 40)
    approach, slope = np.array([curve_at(curve, xi, force) for force in forces]).T
    share = approach / forces
    np.testing.assert_allclose(np.diff(share), np.diff(share).mean(), rtol=1e-6)
    assert (slope > 0).all() and np.diff(share).mean() < 0


def test_a_motion_begins_under_what_flanks_bear_at_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    def only_little(machine: Any, torque: float, t: float) -> float:
        asked.append(torque)
        if torque > 300.0:
            raise ContactError("too much")
        return torque

    monkeypatch.setattr(f"{rest_of.__module__}.{initial_state.__name__}", only_little)
    machine: Any = None
    assert rest_of(machine, 1000.0, 0.0) == 250.0  # type: ignore[comparison-overlap]
    assert asked == [1000.0, 500.0, 250.0]
    with pytest.raises(ContactError, match="too much"):
        rest_of(machine, 1e9, 0.0)
