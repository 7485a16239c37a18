"""From the motion of realisations to their record: rotation, sensors, attributes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.damping import undamped
from gearbench.bench.plan.schedule import Schedule
from gearbench.bench.protocol import Prepared
from gearbench.bench.realisations import Ready, Realisation
from gearbench.bench.record.attributes import experiment_attributes, rig_attributes, shown_mean
from gearbench.bench.record.channels import WHOLE, Stretch, mesh_phases, sensed, with_rotation
from gearbench.bench.record.remarks import beyond_model, divided_steps, joined, lost_contact, unlike_periods, unsettled
from gearbench.bench.record.sensors import repeated, sensor_attributes
from gearbench.geometry import Pair
from gearbench.records import provenance
from gearbench.rig import dump_case
from gearbench.rig.neutral import has_sensors

Array = NDArray[np.float64]


def begin_of(runs: Sequence[Realisation]) -> int:
    """Sample of the clock at which the record begins: where the last of its realisations is steady."""
    return max(run.first for run in runs)


def shown(
    ready: Ready,
    meshing: Pair,
    channels: dict[str, Array],
    runs: Sequence[Realisation],
    begin: int,
    samples: int,
    stretch: Stretch = WHOLE,
) -> dict[str, Array]:
    """Channels (realisations, n) of `runs` as `samples` samples of the record that begins at the clock's sample `begin`
    hold them: with rotation, behind the sensors, mesh phase beside them."""
    case, plan, prepared = ready.case, ready.plan, ready.prepared
    first, at = begin * plan.cycles_per_sample, stretch.at
    absolute = prepared.absolute
    if absolute:
        channels = _aligned(channels, runs, plan, begin)
    elif plan.rotation is not None:
        channels, absolute = with_rotation(channels, plan, at=at), True
    if has_sensors(case.rig):
        seed, ramps = case.experiment.seed, absolute and plan.rotation is None
        swings = with_rotation(channels, plan, first, -1.0, at) if ramps else channels
        teeth = {name: values for name, values in channels.items() if name.startswith(("tooth_force_", "load_share_"))}
        channels = sensed(
            swings, case.rig, meshing, plan, samples=samples, seed=seed, first=first, stretch=stretch
        )
        channels = with_rotation(channels, plan, first, at=at) if ramps else channels
        channels |= teeth  # no sensor sees them
    channels = {name: repeated(values, samples) for name, values in channels.items()}
    channels = channels if absolute else with_rotation(channels, plan, at=at)
    told = mesh_phases(plan, samples, first, at) + case.rig.sensors.mesh_phase_zero
    channels["mesh_phase"] = np.broadcast_to(told, channels["dte"].shape)
    return channels


def _aligned(
    channels: dict[str, Array], runs: Sequence[Realisation], plan: Schedule, begin: int
) -> dict[str, Array]:
    """Absolute angles brought to the latest start: others are whole blocks earlier."""
    late = np.array([begin - run.first for run in runs])[:, None] / plan.sampling_rate
    if not late.any():
        return channels
    speeds = {"angle_driver": plan.speed_driver, "angle_driven": plan.speed_driven}
    return {**channels, **{name: channels[name] + late * speed for name, speed in speeds.items()}}


def record_attributes(ready: Ready, meshing: Pair, runs: Sequence[Realisation]) -> dict[str, Any]:
    """Attributes of the record of these realisations."""
    case, plan, prepared, samples = ready.case, ready.plan, ready.prepared, ready.samples
    lost = None if runs[0].lost is None else sum(run.lost or 0 for run in runs)
    divided = None if runs[0].divided is None else sum(run.divided or 0 for run in runs)
    strayed = None if runs[0].strayed is None else sum(run.strayed or 0 for run in runs)
    begins = [(run.first + run.strayed_first) / plan.sampling_rate for run in runs if run.strayed_first is not None]
    told = (
        beyond_model(strayed or 0, len(runs) * samples, min(begins, default=0.0)),
        lost_contact(lost or 0, len(runs) * samples),
        divided_steps(divided or 0, len(runs) * samples * prepared.substeps),
        unlike_periods(plan),
        unsettled(max(run.residual for run in runs), case.experiment.settling_tolerance, undamped(case)),
    )
    periods = samples // plan.samples_per_period
    return {
        **rig_attributes(case.rig, meshing),
        **experiment_attributes(plan, periods, shown_mean(case.rig, case.experiment.torque_mean)),
        "periods_averaged": plan.blocks if prepared.keep == "mean" else None,
        "settling_residual": max(run.residual for run in runs),
        "settling_periods": max(run.settling_periods for run in runs),
        "repeats_after_mesh_cycles": plan.repeat_cycles,
        "hunting_period": None if plan.rotation else plan.repeat_cycles * plan.mesh_period,
        "contact_lost_samples": lost,
        "beyond_model_samples": strayed,
        "divided_steps": divided,
        "warnings": joined(*told, *prepared.warnings),
        "model": case.simulation.model,
        "substeps": prepared.substeps,
        **prepared.attributes,
        "provenance": provenance(dump_case(case), case.experiment.seed, prepared.settings),
    }


def channel_attributes(
    ready: Ready, runs: Sequence[Realisation], names: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """Attributes of the named channels: those of their sensors, and their scatter."""
    about = sensor_attributes(ready.case.rig, names)
    for name, scatter in _scatter(ready.prepared, runs).items():
        about[name] = {**about.get(name, {}), **scatter}
    return about


def _scatter(prepared: Prepared[Any], runs: Sequence[Realisation]) -> Mapping[str, Mapping[str, float]]:
    """Attribute period_scatter of the channels, the rms over all realisations; none where nothing is averaged."""
    scatters = [run.scatter for run in runs if run.scatter is not None]
    if not scatters:
        return {}
    rms = np.sqrt((np.stack(scatters) ** 2).mean(axis=0))
    spread = prepared.channels(rms[None], np.zeros(1))._asdict()
    measured = ("torque_driven", "angle_driver", "angle_driven", "y_driver", "y_driven")
    return {name: {"period_scatter": abs(float(spread[name][0]))} for name in measured}

