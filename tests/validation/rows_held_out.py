"""Both methods on the finite-element record of `paper_fe` (62/62, reduced model): a realisation held out from them.

Finite elements have no exact ITF: what is scored is the prediction of the second realisation's DTE from the first one.
At 2 Hz mesh it is the record of the case, one period of 1 s; at 200 Hz one multisine of 4 s.
"""

from __future__ import annotations

from functools import cache, partial
from math import sqrt
from typing import Literal

import xarray as xr
from shared.held_out import prediction_error

from gearbench.bench.experiment import simulate
from gearbench.cases import case_path
from gearbench.commands.house.checks import Check, Got
from gearbench.identification import IdentificationSettings
from gearbench.identification.estimation import by_feedback, identify_spectra
from gearbench.identification.lpm.selection import LADDER
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.task import Task, output_lines
from gearbench.rig import read_case

Method = Literal["lpm", "mesh-feedback"]
CHANGES = {
    2: ["experiment.realisations=2"],
    200: [
        "experiment.realisations=2",
        "experiment.mesh_frequency_hz=200",
        "experiment.sampling_rate_hz=16384",
        "experiment.samples_per_period=65536",
        "experiment.periods=2",
    ],
}
# Mesh frequency and largest error: what one such record supports.
ROWS = ((2, 0.05), (200, 0.01))
METHODS: tuple[Method, ...] = ("lpm", "mesh-feedback")


@cache
def record(mesh: int) -> xr.Dataset:
    """Two realisations of the case at that mesh frequency [Hz]."""
    return simulate(read_case(case_path("paper_fe"), CHANGES[mesh]))


def held_out(mesh: int, method: Method) -> Got:
    """Error of the second realisation's response as the result from the first one predicts it, and what mesh feedback
    says and predicts if the local polynomial method does not take over."""
    first, second = (record(mesh).isel(realisation=[number]) for number in (0, 1))
    spectra, excited, _ = record_spectra([first], sidebands=LADDER[-1])
    settings = IdentificationSettings(method, phases=16, modes=0, step=1)
    frf = identify_spectra(spectra, excited, settings)
    note = f"expects {frf.attrs['expected_error']:.1%}; branch 0 alone {prediction_error(frf, second, 0):.1%}"
    if method == "mesh-feedback":
        lines = output_lines(spectra, excited, excited, 1)
        alone = by_feedback(Task(spectra, lines, settings, excited, (), 0.0, lambda part, message: None))
        note += (
            f"; mesh feedback alone {prediction_error(alone, second):.2%}, expects {alone.attrs['expected_error']:.2%},"
            f" with what a realisation leaves at all phases {with_noise(alone):.2%}"
        )
    return Got(prediction_error(frf, second), note)


def with_noise(frf: xr.Dataset) -> float:
    """Error that mesh feedback expects of a prediction: that of the response, and what other realisations hold besides
    it, noise and distortion, as far as the residual does and the response's error does not count it yet."""
    expected, apart, left = (float(frf.attrs[name]) for name in ("expected_error", "unexplained_error", "residual"))
    return sqrt(expected**2 + max(left**2 - apart**2, 0.0))


CHECKS = [
    Check(
        f"held-out-{mesh}hz-{method}",
        f"{method}: held-out realisation of paper_fe, {mesh} Hz mesh",
        reach,
        "",
        partial(held_out, mesh, method),
    )
    for mesh, reach in ROWS
    for method in METHODS
]
