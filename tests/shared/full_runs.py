"""The unreduced rig beside the reduced one: the same rig, step, torque and static start."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import elastic_rig, machine_for
from gearbench.bench.full.run import full_gears, full_machine
from gearbench.bench.record.channels import dte_of, support_factor, turned_by
from gearbench.fem.full import record, start
from gearbench.fem.full.transient import make_integrator
from gearbench.fem.motion import start as reduced_start
from gearbench.fem.motion import transient as reduced
from gearbench.fem.motion.scheme import make_scheme
from gearbench.rig import Rig, Simulation

Array = NDArray[np.float64]


class SideBySide(NamedTuple):
    """Times (n,) [s] of the steps, DTE (n,) [m] of both models and the number of pairs that carry (n,) in each."""

    time: Array
    full: Array
    reduced: Array
    full_loaded: Array
    reduced_loaded: Array

    def difference(self, highest: float) -> float:
        """Rms difference of the DTE without its mean up to a frequency [Hz], over the rms of the full model's."""
        left = band(self.full - self.reduced, self.time, highest)
        return float(np.std(left) / np.std(band(self.full, self.time, highest)))


def band(values: Array, time: Array, highest: float) -> Array:
    """Values (n,) without what lies above a frequency [Hz], a straight line through the ends taken off before."""
    line = np.linspace(values[0], values[-1], len(values))
    spectrum = np.fft.rfft(values - line)
    spectrum[np.fft.rfftfreq(len(values), float(time[1] - time[0])) > highest] = 0.0
    return np.asarray(np.fft.irfft(spectrum, len(values)) + line)


def side_by_side(
    rig: Rig, simulation: Simulation, mesh_frequency: float, rate: float, torque: Array, mean: float
) -> SideBySide:
    """Both models from the static equilibrium of the mean torque, `torque` (n,) [N m] at the end of each step."""
    elastic = elastic_rig(rig, simulation)
    scheme = make_scheme(1.0 / rate, simulation.spectral_radius)
    small = machine_for(elastic, mesh_frequency)
    large = full_machine(elastic, full_gears(rig, simulation, lambda note: None), mesh_frequency)
    _, samples, ran = reduced.advance(small, scheme, reduced_start.initial_state(small, mean), torque, 1)
    run = record.advance(make_integrator(large, scheme), start.initial_state(large, mean), torque)
    if ran.failed >= 0 or ran.off or run.lost or run.off:
        raise RuntimeError("one of the models did not reach the end")
    factor = support_factor(rig, elastic.pair)

    def dte(out: record.Samples | reduced.Samples) -> Array:
        turned = turned_by(elastic.pair, out.angle_driver, out.angle_driven)
        return np.asarray(dte_of(turned, out.y_driver, out.y_driven, factor))

    one, two = record.columns(run.samples), reduced.columns(samples)
    return SideBySide(np.arange(1, len(torque) + 1) / rate, dte(one), dte(two), one.loaded, two.loaded)
