"""From a case and its record to frequency responses: the identified one and, for lumped cases, the truth beside it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.bench.plan.schedule import ProgressReport
from gearbench.bench.results.exact import lumped_periodic_system
from gearbench.identification import IdentificationSettings, exact_frf, frozen_frf, identify
from gearbench.rig import Case, Identification

# About this many frequencies of the identified response are computed exactly: each costs a periodic solution.
EXACT_FREQUENCIES = 250
EXACT_HARMONICS = 100


def identification_settings(wanted: Identification) -> IdentificationSettings:
    """The settings of a case, in which 0 stands for "chosen"; order and window are the local method's."""
    local = wanted.method == "lpm"
    return IdentificationSettings(
        method=wanted.method,
        harmonics=wanted.harmonics or None,
        order=wanted.order if local else None,
        window=(wanted.window or None) if local else None,
        band=wanted.band,
        # Sensors that are late or at the end of their range are what the case asks for, and more realisations too.
        accept_doubts=True,
    )


def identify_case(case: Case, record: xr.Dataset, progress: ProgressReport | None = None) -> xr.Dataset:
    """The frequency response behind a record, identified as the case asks. Raises what `identify` raises."""
    return identify([record], identification_settings(case.identification), progress=progress)


def exact_frequencies(identified: xr.Dataset) -> NDArray[np.float64]:
    """Evenly spread frequencies [Hz] out of an identified response, about EXACT_FREQUENCIES of them."""
    frequency = identified["frequency"].values
    return frequency[:: max(1, frequency.size // EXACT_FREQUENCIES)]


def linearised_modes(case: Case, phases: int = 64) -> xr.Dataset:
    """First natural frequency [Hz] of the elastic rig, linearised under the mean torque at each mesh phase.

    Variables `natural_frequency` (mode, phase). What an identified response tends to for an infinitely slow mesh.
    """
    from gearbench.bench.elastic.rig import elastic_rig, machine_for, natural_frequencies
    from gearbench.bench.plan.schedule import schedule

    machine = machine_for(elastic_rig(case.rig, case.simulation), schedule(case.experiment, case.rig).mesh_frequency)
    phase = np.arange(phases) / phases
    found = [natural_frequencies(machine, case.experiment.torque_mean, float(at))[:1] for at in phase]
    values = np.array([float(modes[0]) if modes.size else np.nan for modes in found])
    return xr.Dataset(
        {"natural_frequency": (("mode", "phase"), values[None], {"units": "Hz"})},
        coords={"phase": ("phase", phase, {"units": "cycles"}), "mode": ("mode", np.arange(1))},
        attrs={"schema": "gearbench-modes/1", "model": "reduced", "mesh_phase_origin": "geometry"},
    )


def reference_results(case: Case, identified: xr.Dataset) -> dict[str, xr.Dataset]:
    """The exact and the frozen response of a lumped case, on frequencies and phases of the identified one."""
    system = lumped_periodic_system(case)
    frequency, phases = exact_frequencies(identified), identified.sizes["phase"]
    harmonics = min(EXACT_HARMONICS, (phases - 1) // 2)
    about = {"mesh_frequency": 1.0 / system.period, "mesh_phase_origin": "geometry", "model": "lumped"}
    return {
        "exact": exact_frf(system, frequency, phases=phases, harmonics=harmonics, attributes=about),
        "frozen": frozen_frf(system, frequency, phases=phases, harmonics=harmonics, attributes=about),
    }
