"""Local polynomial method, mesh feedback and exact response on the reference system."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from functools import lru_cache, partial
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from shared.reference_rig import ReferenceRig, reference_record
from shared.varying_rig import ramp, truth_at, varying_record, wandering

from gearbench.commands.house.checks import Check, Got, NotRun
from gearbench.identification import (
    IdentificationSettings,
    exact_itf,
    frozen_itf,
    harmonic_balance_itf,
    identify,
    itf,
    itf_modes,
)

BAND = (700.0, 2500.0)
FREQUENCIES = np.arange(BAND[0], BAND[1] + 1, 4.0)
PHASES = 512
# Mesh frequency, noise, realisations, and windows (L, R, n).
EXPECTED: tuple[tuple[float, float, int, tuple[tuple[int, int, int], ...]], ...] = (
    (500.0, 0.01, 1, ((3, 1, 14), (5, 2, 24), (7, 3, 42), (9, 2, 60), (9, 4, 60))),
    (500.0, 0.1, 3, ((3, 1, 6), (5, 2, 12), (9, 3, 20), (9, 1, 10))),
    (200.0, 0.0, 1, ((4, 1, 16), (8, 2, 40), (12, 1, 40), (18, 2, 80))),
    (200.0, 0.03, 4, ((4, 1, 6), (12, 2, 16), (18, 3, 28))),
    (50.0, 0.01, 4, ((8, 1, 8), (15, 2, 20), (30, 1, 24), (30, 2, 40))),
)
COURSES: tuple[tuple[Literal["wander", "ramp"], str], ...] = (
    ("wander", "20 Hz mesh wandering by 20 %"),
    ("ramp", "a mesh frequency that rises from 16 to 24 Hz"),
)
# Distance from a switch [cycles] within which the natural frequency is not inside a zone.
AROUND = 0.03
COURSE_RIG = ReferenceRig(mesh_frequency=20.0, edge=0.05)
Pair = tuple[float, float]
METHODS: tuple[tuple[Literal["lpm", "mesh-feedback"], str, float], ...] = (
    ("lpm", "local method, polynomials or smooth branches by its own choice", 0.025),
    ("mesh-feedback", "mesh-feedback", 0.01),
)
# Part of a window that sdynpy's local model reads unless told otherwise, and errors that count as equal.
DEFAULT_RATIO, MORE_ERROR = 0.1, 1.05


@lru_cache(maxsize=1)
def truth() -> NDArray[np.complex128]:
    """Exact ITF of the reference system on FREQUENCIES and PHASES phases."""
    return exact_itf(ReferenceRig().system(), FREQUENCIES, np.arange(PHASES) / PHASES)


def relative(found: NDArray[np.complex128], wanted: NDArray[np.complex128]) -> float:
    """Relative rms difference."""
    return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def lpm_error(harmonics: int) -> float:
    """Error of the ITF from 100 noise-free realisations of 1 s, R = 1, n = 4."""
    record = reference_record(ReferenceRig(), realisations=100, duration=1.0)
    settings = IdentificationSettings(harmonics=harmonics, order=1, window=4, band=BAND, step=4, phases=PHASES)
    found = itf(identify([record], settings))
    return relative(found.sel(frequency=FREQUENCIES).values, truth())


@lru_cache(maxsize=1)
def sparse_truth() -> NDArray[np.complex128]:
    """Exact ITF at 2 Hz on every 8th of FREQUENCIES."""
    return truth()[::8]


@lru_cache(maxsize=2)
def feedback(noise: float) -> tuple[float, float, float]:
    """Mesh feedback from one second of one realisation at 2 Hz and `noise`: error, processor time [s], and worst error
    of the first natural frequency inside the zones."""
    record = reference_record(ReferenceRig(), realisations=1, duration=1.0, noise=noise)
    settings = IdentificationSettings(method="mesh-feedback", band=BAND, step=4, phases=PHASES, modes=0)
    before = time.process_time()
    frf = identify([record], settings)
    spent = time.process_time() - before
    error = relative(itf(frf).sel(frequency=FREQUENCIES[::8]).values, sparse_truth())
    return error, spent, natural_frequency_error(frf)


def natural_frequency_error(frf: xr.Dataset) -> float:
    """Worst relative error of the first natural frequency at 64 phases, those within AROUND of a switch apart, against
    that of the exact ITF; the eigenvalues of the rig that stands still differ from the latter by 0.3 %."""
    step = PHASES // 64
    some = frf.isel(phase=slice(None, None, step)).sel(frequency=FREQUENCIES)
    found, wanted = (
        itf_modes(FREQUENCIES, values, modes=1)[0][0] for values in (itf(some).values, truth()[:, ::step])
    )
    phase = some.phase.values
    apart = [np.abs((phase - at + 0.5) % 1.0 - 0.5) for at in (0.0, ReferenceRig().contact_ratio - 1.0)]
    inside = np.min(apart, axis=0) > AROUND
    return float(np.max(np.abs(found / wanted - 1.0)[inside]))


@lru_cache(maxsize=6)
def at_speed(mesh_frequency: float, method: Literal["lpm", "mesh-feedback"]) -> float:
    """Error with all choices left to the program, from one multisine of 4 s at 40 dB."""
    rig = ReferenceRig(mesh_frequency=mesh_frequency)
    record = reference_record(
        rig, realisations=1, duration=4.0, sampling_rate=16000.0, band=(1.0, 5000.0), noise=0.01
    )
    frequency = FREQUENCIES[::8]
    settings = IdentificationSettings(method=method, band=BAND, step=16, phases=128, modes=0)
    found = itf(identify([record], settings)).sel(frequency=frequency).values
    return relative(found, exact_itf(rig.system(512), frequency, np.arange(128) / 128))


@lru_cache(maxsize=3)
def course_record(course: Literal["wander", "ramp", "constant"]) -> xr.Dataset:
    """One second at a speed that wanders by 20 %, rises by half, or does neither, 40 dB, by DOP853."""
    phase = {"wander": wandering(20.0, 1.0), "ramp": ramp(16.0, 24.0, 1.0), "constant": ramp(20.0, 20.0, 1.0)}[course]
    return varying_record(COURSE_RIG, phase, duration=1.0, noise=0.01)


@lru_cache(maxsize=6)
def varying(course: Literal["wander", "ramp", "constant"], method: Literal["lpm", "mesh-feedback"]) -> Pair:
    """Error from one second of a course, and what was expected."""
    step = 40 if method == "mesh-feedback" else 4
    frf = identify([course_record(course)], IdentificationSettings(method, band=BAND, step=step, phases=128, modes=0))
    some = frf.isel(frequency=slice(None, None, 40 // step))
    return relative(itf(some).values, truth_at(COURSE_RIG, some)), float(frf.attrs["expected_error"])


def against_constant(course: Literal["wander", "ramp"]) -> Got:
    """Error of the local polynomial method over that at constant speed."""
    here, there = varying(course, "lpm"), varying("constant", "lpm")
    return Got(here[0] / there[0], f"errs by {here[0]:.1%}, expects {here[1]:.1%}; constant {there[0]:.1%}")


def expected_at_varying_speed() -> float:
    """Expected over actual error of the local polynomial method on both courses, or its inverse: the worst."""
    ratios = [expected / error for error, expected in (varying(course, "lpm") for course, _ in COURSES)]
    return max(max(ratios), 1.0 / min(ratios))


def expected_errors() -> float:
    """Expected over actual error of the local polynomial method, or its inverse: the worst of 20 settings."""
    ratios = []
    for mesh, noise, realisations, windows in EXPECTED:
        rig = ReferenceRig(mesh_frequency=mesh)
        given = {"duration": 1.0, "sampling_rate": 16000.0, "band": (1.0, 5000.0), "noise": noise}
        record = reference_record(rig, realisations=realisations, **given)
        exact = exact_itf(rig.system(512), FREQUENCIES[::8], np.arange(128) / 128)
        for harmonics, order, window in windows:
            settings = IdentificationSettings(
                harmonics=harmonics, order=order, window=window, band=BAND, step=4, phases=128, modes=0
            )
            frf = identify([record], settings)
            error = relative(itf(frf).sel(frequency=FREQUENCIES[::8]).values, exact)
            ratios.append(frf.attrs["expected_error"] / error)
    return max(max(ratios), 1.0 / min(ratios))


def deviations(quantity: str) -> float:
    """Empirical over predicted standard deviation of mesh feedback's `quantity`, or its inverse: 12 draws of noise."""
    frfs = repeated_feedback()
    values = np.array([itf(frf).values if quantity == "itf" else frf[quantity].values for frf in frfs])
    empirical = float(np.mean(np.var(values, axis=0, ddof=1)))
    ratio = float(np.sqrt(np.mean([frf[f"{quantity}_var"].values.mean() for frf in frfs]) / empirical))
    return max(ratio, 1.0 / ratio)


@lru_cache(maxsize=1)
def repeated_feedback() -> list[xr.Dataset]:
    """Mesh feedback of one record of 1 s at 50 Hz mesh with twelve draws of noise, 40 dB."""
    clean = reference_record(ReferenceRig(mesh_frequency=50.0), realisations=1, duration=1.0, sampling_rate=8000.0)
    size = 0.01 * float((clean.dte - clean.dte.mean()).std())
    settings = IdentificationSettings(method="mesh-feedback", band=BAND, step=20, phases=64, modes=0)
    draws = (np.random.default_rng(seed).standard_normal(clean.dte.shape) for seed in range(12))
    return [identify([clean.assign(dte=clean.dte + size * draw)], settings) for draw in draws]


def formulations() -> float:
    """Monodromy against harmonic balance on the reference system with edges 20 % wide, at three frequencies."""
    system = ReferenceRig(edge=0.2).system(256)
    frequency, phase = np.array([800.0, 1100.0, 1231.0]), np.arange(32) / 32
    first = exact_itf(system, frequency, phase, steps=40960)
    return relative(first, harmonic_balance_itf(system, frequency, phase))


def frozen() -> float:
    """Distance of the stated 16 % between the frozen transfer function and the truth."""
    found = frozen_itf(ReferenceRig().system(), FREQUENCIES, np.arange(PHASES) / PHASES)
    return abs(relative(found, truth()) - 0.16)


def peer() -> Got:
    """Processor time of sdynpy's LPM, fed with shifted spectra and otherwise as it comes, over ours."""
    python = os.environ.get("GEARBENCH_SDYNPY")
    if python is None:
        raise NotRun("GEARBENCH_SDYNPY names no Python of an environment that has sdynpy, psutil and joblib")
    script = Path(__file__).resolve().parents[2] / "benchmarks" / "local_polynomials.py"
    command = [sys.executable, "-P", str(script), "--peer", python, "--repeats", "3", "--json"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    told = json.loads(done.stdout)
    if not told["sdynpy"]:
        raise NotRun(f"{python} cannot run sdynpy")
    (ours, error), (theirs, other) = told["ours"], told["sdynpy"][str(DEFAULT_RATIO)]
    if error > MORE_ERROR * other:
        raise RuntimeError(f"the errors are not equal: {error:.3g} and sdynpy's {other:.3g}")
    return Got(theirs / ours, f"errors {error:.2%} and {other:.2%}")


def peak_memory() -> Got:
    """Peak resident memory [GiB] of L = 150, 100 realisations, 2^17 lines, in a process of its own."""
    script = Path(__file__).resolve().parents[2] / "benchmarks" / "lpm_memory.py"
    done = subprocess.run([sys.executable, "-P", str(script), "--json"], stdout=subprocess.PIPE, text=True, check=True)
    told = json.loads(done.stdout)
    return Got(told["peak_gib"], f"{told['processor_s']:.0f} s of processor time")


CHECKS = [
    Check("lpm-100", "LPM, reference system, 100 x 1 s, noise-free: L = 100", 0.04, "", lambda: lpm_error(100)),
    Check("lpm-150", "LPM, reference system, 100 x 1 s, noise-free: L = 150", 0.006, "", lambda: lpm_error(150)),
    Check("mesh-feedback-40db", "mesh-feedback ITF, 1 s, 2 Hz, 40 dB", 0.01, "", lambda: feedback(0.01)[0]),
    Check("mesh-feedback-30db", "mesh-feedback ITF, 1 s, 2 Hz, 30 dB", 0.04, "", lambda: feedback(10**-1.5)[0]),
    Check(
        "mesh-feedback-modes",
        "the same at 40 dB: first natural frequency inside the zones",
        0.002,
        "",
        lambda: feedback(0.01)[2],
    ),
    Check("mesh-feedback-time", "the same at 40 dB: processor time", 15.0, "s", lambda: feedback(0.01)[1]),
    *(
        Check(f"{method}-{mesh}hz", f"{words}, {mesh} Hz mesh, 4 s, 40 dB", reach, "", partial(at_speed, mesh, method))
        for method, words, reach in METHODS
        for mesh in (50, 200, 500)
    ),
    *(
        Check(
            f"varying-{course}",
            f"mesh-feedback, 1 s at {words}, 40 dB",
            0.01,
            "",
            partial(lambda course: varying(course, "mesh-feedback")[0], course),
        )
        for course, words in COURSES
    ),
    *(
        Check(
            f"varying-lpm-{course}",
            f"LPM, 1 s at {words}, 40 dB: error over that at constant speed",
            3.0,
            "times",
            partial(against_constant, course),
        )
        for course, words in COURSES
    ),
    Check("varying-lpm-expected", "LPM there: expected against actual error", 2.0, "times", expected_at_varying_speed),
    Check("lpm-expected", "LPM: expected against actual error, worst of 20 settings", 2.0, "times", expected_errors),
    *(
        Check(
            f"deviations-{quantity}",
            f"mesh-feedback: predicted against empirical deviation, {quantity}",
            1.6,
            "times",
            partial(deviations, quantity),
        )
        for quantity in ("itf", "mesh_stiffness")
    ),
    Check("exact-itf", "exact ITF: monodromy against harmonic balance", 1e-8, "", formulations),
    Check("frozen-itf", "frozen against exact ITF: distance from the stated 16 %", 0.01, "", frozen),
    Check("lpm-memory", "LPM, L = 150, 100 realisations, 2^17 lines: peak memory", 4.0, "GiB", peak_memory),
    Check("lpm-peer", "PTV-LPM against sdynpy's LPM fed with shifted spectra", 10.0, "times", peer, least=True),
]
