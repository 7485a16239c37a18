"""Truth rigs around a user's nominal rig, under the conditions and the noise of his records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.challenge.errors import ChallengeError
from gearbench.challenge.making.plan import Mix
from gearbench.challenge.truth.effects import EFFECTS
from gearbench.rig import Case, Condition, Experiment
from gearbench.rig.experiment import Multisine

Array = NDArray[np.float64]

FEWEST = 6
HIGHEST = 0.45  # end of the band of a measured torque, over the sampling rate


class Measured(NamedTuple):
    """A record: name, driver torque over one excitation period (N,) [N m], sampling rate and mesh frequency [Hz]."""

    name: str
    torque: Array
    sampling_rate: float
    mesh_frequency: float


def nominal_under(nominal: Case, records: Sequence[Measured], noise: Mapping[str, float]) -> Case:
    """The nominal case with the records as its conditions, and with sensors of that noise: rms of one sample of
    "angle" [rad], "displacement" [m] and "torque" [N m]."""
    conditions = tuple(Condition(name=one.name, experiment=_experiment(nominal.experiment, one)) for one in records)
    update = {f"noise_{name}": value for name, value in noise.items()}
    rig = nominal.rig.model_copy(update={"sensors": nominal.rig.sensors.model_copy(update=update)})
    return nominal.model_copy(
        update={"rig": rig, "experiment": conditions[0].experiment, "conditions": conditions, "assumed": ()}
    )


def _experiment(base: Experiment, one: Measured) -> Experiment:
    swing, samples = float(np.std(one.torque)), one.torque.size
    mean = float(one.torque.mean())
    band = (one.sampling_rate / samples, HIGHEST * one.sampling_rate)
    # The torque itself is imposed; this only says how large it is.
    multisine = Multisine(rms=max(swing, 1e-6 * abs(mean)), band=band)
    return base.at_mesh_frequency(one.mesh_frequency).model_copy(
        update={
            "torque_mean": mean,
            "sampling_rate": one.sampling_rate,
            "samples_per_period": samples,
            "periods": 2,
            "realisations": 1,
            "multisine": multisine,
        }
    )


def mix_of(cases: int, seed: int) -> Mix:
    """A mix for a calibration: a third of the rigs sound, a quarter with something foreign, the rest with an effect.
    Raises ChallengeError for too few."""
    if cases < FEWEST:
        raise ChallengeError(f"a calibration with {cases} rigs tells nothing: at least {FEWEST}")
    controls, foreign = round(cases / 3), round(cases / 4)
    rest = cases - controls - foreign
    each, more = divmod(rest, len(EFFECTS))
    chosen = set(np.random.default_rng(seed).permutation(len(EFFECTS))[:more].tolist())
    return Mix(controls, tuple(each + (number in chosen) for number in range(len(EFFECTS))), foreign)
