"""What an experiment will resolve, before it is measured.

The linearised lumped model of a case has a known harmonic transfer function. With it the spectra of the planned record
are written down, line by line and with noise, in place of being integrated; the identification that the record would
get is carried out on them, and both what it expects of itself and what it errs by are known. Where L, R or n are
prescribed and err by more than ENOUGH, the identification that chooses them is carried out as well: it tells whether
they or the record are what limits.

    Y(k) = sum_l G_l(k - l d) U(k - l d) + noise,     noise: `snr_db` below the response, rms over the excited band
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, sqrt
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gearbench.bench.errors import BenchError
from gearbench.bench.plan.excitation import torque_realisation
from gearbench.bench.plan.schedule import ProgressReport, schedule
from gearbench.bench.results.exact import lumped_periodic_system
from gearbench.geometry import pair
from gearbench.identification.estimation import identify_spectra
from gearbench.identification.lpm.accuracy import BANDWIDTHS, RULE
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.response.frf import itf
from gearbench.identification.spectra.joint import Spectra, joint_periods
from gearbench.identification.task import IdentificationSettings
from gearbench.identification.truth.monodromy import exact_itf
from gearbench.identification.truth.periodic import PeriodicSystem, frozen_itf, htf_from_itf, itf_from_htf
from gearbench.rig import Case

Complexes = NDArray[np.complex128]

# Frequencies on which the transfer function is computed: so many to the narrowest half-power bandwidth, and at most.
PER_BANDWIDTH = 8
MOST_FREQUENCIES = 1500
# Branches of it that are kept, and the fewest phases of the ITF behind them.
BRANCHES = 200
PHASES = 1000
# Phases on which frozen modes are followed.
FOLLOWED = 64
# Relative rms error of the ITF up to which prescribed L, R and n are not compared with those that would be chosen.
ENOUGH = 0.02
# What an identification says of its fit, and of what limits it.
ACCOUNT = (
    *("method", "branches", "harmonics", "order", "window", "smooth_bandwidth", "joint_period", "periods_averaged"),
    *("unknowns", "equations", "expected_error", "variance_error", "truncation_error", "unexplained_error"),
    *("noise_error", "branches_error", "window_error", "limited_by"),
)

Numbers = tuple[int | None, int | None, int | None]


@dataclass(frozen=True)
class Fit:
    """One identification of the planned record: `method` and `window` (L, R, n) as carried out; `expected`: what it
    expects to err by, `actual`: what it errs by (relative rms of the ITF over `identified` [Hz]); `account`: the
    attributes of the result that say what limits it, with the first mode's `bandwidth` [Hz]."""

    method: str
    window: Numbers
    identified: tuple[float, float]
    expected: float
    actual: float
    account: dict[str, Any]


@dataclass(frozen=True)
class Design:
    """A planned experiment and what it will resolve.

    `lines` excited lines a realisation, `spacing` [Hz] apart in `band` [Hz], of `duration` [s] a joint period of
    excitation and mesh, `distinct` [s] of different excitation in all; torque `peak`, `rms` [N m] and `crest` of the
    multisine; `natural` [Hz]: lowest and highest first natural frequency over the mesh, `bandwidth` [Hz] its half-power
    bandwidth; `branches` that the travel of that mode asks for and `needed` [s] of distinct excitation for them;
    `headroom`: factor by which the multisine may grow until the linear response would unload the mesh; `expected`: what
    the identification will expect to err by, `actual`: what it errs by on the synthetic spectra (relative rms of the
    ITF over `identified` [Hz]); `method` and `window` (L, R, n) as carried out, `account` of what limits them (Fit).

    `prescribed`: L, R and n that the settings ask for; `refusal`: why the record cannot be identified with them, else
    empty (the numbers are then those of the free choice); `free`: the choice without them, where they were refused or
    err by more than ENOUGH.
    """

    mesh_frequency: float
    lines: int
    spacing: float
    band: tuple[float, float]
    realisations: int
    duration: float
    distinct: float
    peak: float
    rms: float
    crest: float
    natural: tuple[float, float]
    bandwidth: float
    branches: int
    needed: float
    headroom: float
    snr_db: float
    identified: tuple[float, float]
    method: str
    window: Numbers
    expected: float
    actual: float
    account: dict[str, Any]
    prescribed: Numbers
    refusal: str
    free: Fit | None

    @property
    def enough(self) -> bool:
        """Whether the response is known so well that other L, R and n need no trial."""
        return self.actual <= ENOUGH

    @property
    def realisations_needed(self) -> int:
        """Realisations of the same period that the record-length rule asks for."""
        return ceil(self.needed / (self.distinct / self.realisations) - 1e-9)


def design(
    case: Case, settings: IdentificationSettings, *, snr_db: float = 40.0, progress: ProgressReport | None = None
) -> Design:
    """Judge the experiment of a case by the identification that `settings` ask for.

    `snr_db`: torque-induced DTE over noise, rms in the excited band. Raises BenchError for a case without a multisine;
    MultisineError, PeriodicSystemError and LpmError as their makers do.
    """
    wanted = case.experiment.multisine
    if wanted is None:
        raise BenchError("the case has no experiment.multisine: there is nothing to plan")
    if case.experiment.changes_speed:
        raise BenchError(
            "experiment.speed_end_rpm or speed_table changes the speed: a multisine is planned for a constant one"
        )
    if not -20.0 <= snr_db <= 200.0:
        raise BenchError(f"a signal-to-noise ratio of {snr_db:g} dB must lie between -20 and 200")
    report = progress or (lambda fraction, message: None)
    report(0.0, "exact response")
    system = lumped_periodic_system(case)
    natural, bandwidth = _first_mode(system)
    htf = _known_htf(system, wanted.band, bandwidth)
    report(0.2, "spectra")
    clean, peak, rms = _spectra(case, htf)
    spectra = _noisy(clean, wanted.band, snr_db, case.experiment.seed)
    excited = np.flatnonzero(np.abs(clean.force).max(axis=0)[1:]) + 1
    edges = float(excited[0] * clean.spacing), float(excited[-1] * clean.spacing)
    mesh_frequency = clean.mesh_lines * clean.spacing
    branches = ceil((natural[1] - natural[0] + BANDWIDTHS * bandwidth) / mesh_frequency)
    fit = partial(_fit, edges, htf, bandwidth)
    asked, free, refusal = _fits(fit, spectra, settings, report)
    if free is not None and not refusal and asked.account.get("branches") == "polynomials":
        asked = _with_cause(asked, partial(fit, replace(clean, noise=np.zeros(clean.highest + 1))), settings)
    order = asked.window[1]
    return Design(
        mesh_frequency=mesh_frequency,
        lines=int(np.count_nonzero(np.abs(clean.force[0, 1:]))),
        spacing=clean.spacing * clean.repeats,
        band=edges,
        realisations=clean.realisations,
        duration=clean.duration,
        distinct=clean.realisations * clean.duration / clean.repeats,
        peak=peak,
        rms=rms,
        crest=peak / rms,
        natural=natural,
        bandwidth=bandwidth,
        branches=branches,
        needed=RULE * (2 * branches + 1) * ((1 if order is None else order) + 1) / bandwidth,
        headroom=_headroom(case, system, clean),
        snr_db=snr_db,
        identified=asked.identified,
        method=asked.method,
        window=asked.window,
        expected=asked.expected,
        actual=asked.actual,
        account=asked.account,
        prescribed=_prescribed(settings),
        refusal=refusal,
        free=free,
    )


def _prescribed(settings: IdentificationSettings) -> Numbers:
    return settings.harmonics, settings.order, settings.window


def _fits(
    fit: Callable[[Spectra, IdentificationSettings, ProgressReport], Fit],
    spectra: Spectra,
    settings: IdentificationSettings,
    report: ProgressReport,
) -> tuple[Fit, Fit | None, str]:
    """The identification as asked for; the one that chooses L, R and n, where there is reason to compare; and why the
    first cannot be, in whose place the second then stands. Raises LpmError where neither can be."""
    report(0.3, "identification")
    refusal = ""
    asked: Fit | None = None
    try:
        asked = fit(spectra, settings, lambda part, note: report(0.3 + 0.35 * part, note))
    except LpmError as error:
        if _prescribed(settings) == (None, None, None):
            raise
        refusal = str(error)
    if asked is not None and (_prescribed(settings) == (None, None, None) or asked.actual <= ENOUGH):
        return asked, None, ""
    chosen = replace(settings, harmonics=None, order=None, window=None)
    try:
        free = fit(spectra, chosen, lambda part, note: report(0.65 + 0.35 * part, note))
    except LpmError:
        if asked is None:
            raise
        return asked, None, ""
    return asked or free, free, refusal


def _with_cause(
    asked: Fit, fit: Callable[[IdentificationSettings, ProgressReport], Fit], settings: IdentificationSettings
) -> Fit:
    """The same with the account of what limits it known: `fit` sees spectra known to be without noise.

    What one period takes for missing response may be noise; here the error without any is known, and the rest is noise.
    """
    harmonics, order, window = asked.window
    quiet = fit(replace(settings, harmonics=harmonics, order=order, window=window), lambda part, note: None)
    noise = sqrt(max(asked.actual**2 - quiet.actual**2, 0.0))
    limit = "noise" if noise > quiet.actual else quiet.account["limited_by"]
    return replace(asked, account=quiet.account | {"noise_error": noise, "limited_by": limit})


def _fit(
    edges: tuple[float, float],
    htf: CubicSpline,
    bandwidth: float,
    spectra: Spectra,
    settings: IdentificationSettings,
    report: ProgressReport,
) -> Fit:
    """What the identification of the spectra finds. Raises LpmError."""
    found = identify_spectra(spectra, edges, settings, progress=report)
    frequency = found["frequency"].values
    account = {name: found.attrs[name] for name in ACCOUNT if found.attrs.get(name) is not None}
    return Fit(
        method=str(found.attrs["method"]),
        window=tuple(found.attrs.get(name) for name in ("harmonics", "order", "window")),  # type: ignore[arg-type]
        identified=(float(frequency[0]), float(frequency[-1])),
        expected=float(found.attrs["expected_error"]),
        actual=_error(found, htf),
        account=account | {"bandwidth": bandwidth},
    )


def _known_htf(system: PeriodicSystem, band: tuple[float, float], bandwidth: float) -> CubicSpline:
    """The exact HTF (2 BRANCHES + 1,) over frequency [Hz] in a band, fine enough for modes of that bandwidth [Hz]."""
    width = band[1] - band[0]
    step = min(bandwidth / PER_BANDWIDTH, width / 20)
    if width / step > MOST_FREQUENCIES:
        step = width / MOST_FREQUENCIES
    grid = np.arange(band[0], band[1] + 2 * step, step)
    phases = _phases(system)
    return CubicSpline(grid, htf_from_itf(exact_itf(system, grid, np.arange(phases) / phases), BRANCHES), axis=1)


def _phases(system: PeriodicSystem) -> int:
    """Number of phases, at least PHASES, on the grid of the system where there is one."""
    known = [system.phases // n for n in range(1, system.phases // PHASES + 1) if system.phases % n == 0]
    return min(known, default=PHASES)


def _first_mode(system: PeriodicSystem) -> tuple[tuple[float, float], float]:
    """Range of the lowest frozen natural frequency [Hz] and its mean half-power bandwidth [Hz]."""
    a, _, _ = system.balanced().at(np.arange(FOLLOWED) / FOLLOWED)
    values = np.linalg.eigvals(a)
    values = np.where(values.imag > 1e-9 * np.abs(values).max(), values, np.inf)
    first = values[np.arange(FOLLOWED), np.argmin(np.abs(values), axis=1)]
    if not np.isfinite(first).all():
        raise BenchError("the lumped model has no oscillating mode at some mesh phase: there is nothing to resolve")
    frequency = np.abs(first) / (2 * np.pi)
    return (float(frequency.min()), float(frequency.max())), float(np.mean(-2 * first.real) / (2 * np.pi))


def _spectra(case: Case, htf: CubicSpline) -> tuple[Spectra, float, float]:
    """Noise-free spectra of the planned record without its operating response; peak and rms of the torque [N m]."""
    experiment, plan = case.experiment, schedule(case.experiment, case.rig)
    radius = pair(case.rig).driver.base_radius
    repeats, d = joint_periods(
        experiment.samples_per_period, experiment.sampling_rate, experiment.periods, plan.mesh_period
    )
    samples = repeats * experiment.samples_per_period
    highest = (samples - 1) // 2
    shape = experiment.realisations, highest + 1
    force, dte = np.zeros(shape, dtype=complex), np.zeros(shape, dtype=complex)
    peak = rms = 0.0
    for number in range(experiment.realisations):
        signal = torque_realisation(experiment, number, case.rig).signal
        assert signal is not None
        peak, rms = max(peak, signal.peak), max(rms, signal.rms)
        lines = signal.lines * repeats
        force[number, lines] = 0.5 * signal.spectrum / radius
    driven = np.flatnonzero(np.abs(force).max(axis=0))
    spacing = experiment.sampling_rate / samples
    response = htf(driven * spacing)
    for branch in range(-BRANCHES, BRANCHES + 1):
        # What lies beyond half the sampling rate is seen mirrored: records are filtered once they are sampled.
        rows = (driven + branch * d + samples // 2) % samples - samples // 2
        part = response[branch + BRANCHES] * force[:, driven]
        above, below = (rows > 0) & (rows <= highest), (rows < 0) & (rows >= -highest)
        dte[:, rows[above]] += part[:, above]
        dte[:, -rows[below]] += part[:, below].conj()
    periods = experiment.periods // repeats
    start = np.zeros(experiment.realisations)
    return Spectra(force, dte, spacing, d, start, True, periods, repeats, samples=samples), peak, rms


def _noisy(clean: Spectra, band: tuple[float, float], snr_db: float, seed: int) -> Spectra:
    """The spectra with white noise, `snr_db` below the rms response in the band; periods average it."""
    lines = slice(max(1, ceil(band[0] / clean.spacing)), int(band[1] / clean.spacing) + 1)
    power = float(np.mean(np.abs(clean.dte[:, lines]) ** 2))
    size = np.sqrt(power / 10 ** (snr_db / 10) / clean.periods / 2)
    draw = np.random.default_rng(seed).standard_normal((2, *clean.dte.shape))
    noise = size * (draw[0] + 1j * draw[1])
    known = np.full(clean.highest + 1, 2 * size**2) if clean.periods > 1 else None
    return replace(clean, dte=clean.dte + noise, noise=known)


def _headroom(case: Case, system: PeriodicSystem, clean: Spectra) -> float:
    """How often the multisine fits into the mean load before the linear response would unload the mesh."""
    radius = pair(case.rig).driver.base_radius
    compliance = frozen_itf(system, [0.0], np.arange(FOLLOWED) / FOLLOWED).real.min()
    mean = compliance * case.experiment.torque_mean / radius
    samples = 2 * clean.highest + 1
    largest = max(float(np.abs(np.fft.irfft(one * samples, samples)).max()) for one in clean.dte)
    return float(mean / largest)


def _error(found: xr.Dataset, htf: CubicSpline) -> float:
    """Relative rms error of an identified ITF against the one that made the spectra."""
    frequency = found["frequency"].values
    identified = itf(found)
    truth = itf_from_htf(htf(frequency), identified.sizes["phase"])
    return float(np.linalg.norm(identified.values - truth) / np.linalg.norm(truth))
