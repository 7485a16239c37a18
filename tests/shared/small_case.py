"""A pair of 20 and 30 teeth on the non-linear lumped rig, whose 60 teeth of hunting pass in 0.3 s."""

from __future__ import annotations

from typing import Any

from gearbench.rig import Case, Experiment, Gear, Multisine, Rig, Simulation, Support, Supports

Values = dict[str, Any]


def small_case(
    driver: Values | None = None,
    driven: Values | None = None,
    experiment: Values | None = None,
    simulation: Values | None = None,
    **rig: Any,
) -> Case:
    """The case with other fields of its gears, experiment, simulation and rig."""
    gear = {"module": 3e-3, "face_width": 0.02, "thinning": 30e-6}
    one = {"teeth": 20, "hub_radius": 15e-3, "inertia": 5e-4, "mass": 2.0, **gear, **(driver or {})}
    two = {"teeth": 30, "hub_radius": 25e-3, "inertia": 3e-3, "mass": 3.0, **gear, **(driven or {})}
    support = Support(stiffness=1e8, damping=3e3)
    run: Values = {
        "mesh_frequency": 200.0,
        "torque_mean": 100.0,
        "sampling_rate": 5120.0,
        "samples_per_period": 1536,
        "periods": 2,
        "seed": 3,
        "multisine": Multisine(amplitude=20.0, band=(20.0, 2000.0), crest=2.2),
        **(experiment or {}),
    }
    held: Values = {"support": Supports(driver=support, driven=support)}
    return Case(
        name="test",
        rig=Rig(driver=Gear(**one), driven=Gear(**two), **held | rig),
        experiment=Experiment(**run),
        simulation=Simulation(model="lumped", stiffness_edge=0.1, **(simulation or {})),
    )
