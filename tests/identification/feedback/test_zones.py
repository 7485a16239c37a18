"""Zones of phase: their functions, their evidence, and the fit in them against the rig that made the record."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicHermiteSpline
from shared.predicted import assert_deviations_are_as_predicted
from shared.reference_rig import ReferenceRig, reference_record
from shared.rig_model import rig_model

from gearbench.identification import IdentificationSettings, identify, itf
from gearbench.identification.feedback.data import class_data
from gearbench.identification.feedback.evidence import Evident, Marginal, averaged, evident
from gearbench.identification.feedback.refine import output_error, refined
from gearbench.identification.feedback.shapes import Mesh, Shapes, of_zones, only_zones
from gearbench.identification.feedback.zones import Zones, real_columns
from gearbench.identification.spectra.records import record_spectra
from gearbench.identification.truth.monodromy import exact_itf

RIG = ReferenceRig(mesh_frequency=64.0)
SAMPLES = 8192
ZONES = Zones((0.1, 0.65), 0.05, 1)


def levels(first: float, second: float, width: float) -> NDArray[np.float64]:
    """0 and 1 between two switches, joined by 3 t^2 - 2 t^3, written down phase by phase."""
    phase = np.arange(SAMPLES) / SAMPLES
    rise, fall = (np.clip((phase - at) / width + 0.5, 0.0, 1.0) for at in (first, second))
    return np.asarray(rise**2 * (3 - 2 * rise) - fall**2 * (3 - 2 * fall))


def harmonics(values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """The mesh's part (4 L,) of a stiffness, with no damping."""
    found = np.fft.rfft(values)[1 : count + 1] / SAMPLES
    return np.concatenate([found.real, found.imag, np.zeros(2 * count)])


@pytest.mark.parametrize("pieces", [1, 3])
def test_functions_of_zones_hold_any_cubics_with_continuous_slopes(pieces: int) -> None:
    """Values and slopes drawn at random, between them scipy's Hermite spline: nothing is left of its harmonics."""
    zones = Zones((0.1, 0.65), 0.05, pieces)
    columns = real_columns(zones.coefficients(60))
    across = 0.05 * (np.arange(pieces + 1) / pieces - 0.5)
    breaks = np.concatenate([0.1 + across, 0.65 + across, 1.1 + across[:1]])
    values, slopes = np.random.default_rng(3).standard_normal((2, breaks.size))
    values[-1], slopes[-1] = values[0], slopes[0]
    phase = (np.arange(SAMPLES) / SAMPLES - breaks[0]) % 1.0 + breaks[0]
    mesh = harmonics(CubicHermiteSpline(breaks, values, 10 * slopes)(phase), 60)
    left = mesh - columns @ np.linalg.lstsq(columns, mesh, rcond=None)[0]
    assert columns.shape[1] == 2 * (2 * (breaks.size - 1) - 1)
    assert np.linalg.norm(left) < 1e-4 * np.linalg.norm(mesh)


def test_moves_are_those_of_an_edge() -> None:
    """Levels whose first edge moves, or whose edges widen, by differences of the formula."""
    mesh = harmonics(levels(0.1, 0.65, 0.05), 60)
    moves = ZONES.moves(mesh)
    step = 1e-3
    for number, (more, less) in enumerate(
        [
            (levels(0.1 + step, 0.65, 0.05), levels(0.1 - step, 0.65, 0.05)),
            (levels(0.1, 0.65 + step, 0.05), levels(0.1, 0.65 - step, 0.05)),
            (levels(0.1, 0.65, 0.05 + step), levels(0.1, 0.65, 0.05 - step)),
        ]
    ):
        wanted = (harmonics(more, 60) - harmonics(less, 60)) / (2 * step)
        assert moves[:, number] == pytest.approx(wanted, abs=0.01 * np.abs(wanted).max())


def gaussian(scale: float) -> tuple[Marginal, Shapes, NDArray[np.float64], NDArray[np.float64]]:
    """40 equations of 6 amplitudes, 3 of a group each, the second of the given size; their columns and right sides."""
    rng = np.random.default_rng(2)
    matrix = rng.standard_normal((40, 6))
    y = matrix @ (np.repeat([1.0, scale], 3) * rng.standard_normal(6)) + 0.1 * rng.standard_normal(40)
    shapes = Shapes(np.eye(8)[:, :6], 0, np.ones(6), np.repeat([0, 1], 3))
    return Marginal(matrix.T @ matrix, matrix.T @ y, float(y @ y), 40.0), shapes, matrix, y


def test_evidence_is_the_density_of_the_equations() -> None:
    """Against the Gaussian density of y with the covariance v I + A P^-1 A^T, for three priors and noises."""
    error, _, matrix, y = gaussian(1.0)
    found, wanted = [], []
    for size, noise in ((1.0, 0.01), (0.2, 0.01), (1.0, 0.1)):
        found.append(Evident.of(error, np.full(6, 1 / size), noise).value)
        covariance = noise * np.eye(40) + size * matrix @ matrix.T
        wanted.append(np.linalg.slogdet(covariance)[1] + y @ np.linalg.solve(covariance, y))
    assert np.diff(found) == pytest.approx(np.diff(wanted))


def test_sizes_and_noise_are_the_likeliest() -> None:
    error, shapes, _, _ = gaussian(1.0)
    best = evident(error, shapes, error.least(), 40)
    for factor in (0.8, 1.25):
        for group in (0, 1):
            other = np.where(shapes.group == group, factor, 1.0) * best.precision
            assert Evident.of(error, other, best.noise).value > best.value
        assert Evident.of(error, best.precision, factor * best.noise).value > best.value


def test_a_remainder_that_does_not_show_keeps_a_size() -> None:
    """None is there: the likeliest size is none, the averaged one about what the equations can hide, .1 / sqrt(40)."""
    error, shapes, _, _ = gaussian(0.0)
    likeliest = evident(error, shapes, error.least(), 40)
    found = averaged(error, shapes, likeliest, 1, 0)
    deviation = found.precision[-1] ** -0.5
    assert likeliest.precision[-1] ** -0.5 < 1e-3
    assert 0.005 < deviation < 0.05


def test_shapes_hold_zones_moves_and_a_remainder() -> None:
    mesh = harmonics(levels(0.1, 0.65, 0.05), 60)
    shapes = of_zones(ZONES, mesh, 20)
    amplitudes = np.random.default_rng(0).standard_normal(shapes.weight.size)
    columns = np.random.default_rng(1).standard_normal((5, 240))
    assert shapes.columns(columns) @ amplitudes == pytest.approx(columns @ shapes.of(amplitudes))
    rest = shapes.of(amplitudes) - shapes.functions @ amplitudes[: shapes.functions.shape[1]]
    assert np.flatnonzero(rest).tolist() == [60 * part + order for part in range(4) for order in range(20)]


@pytest.fixture(scope="module")
def record() -> xr.Dataset:
    """Half a second at 30 dB, edges of 2 %."""
    return reference_record(RIG, realisations=1, duration=0.5, band=(2.0, 2600.0), noise=10**-1.5, start_phase=0.3)


@pytest.fixture(scope="module")
def identified(record: xr.Dataset) -> xr.Dataset:
    settings = IdentificationSettings(method="mesh-feedback", band=(800.0, 1600.0), phases=64, step=8, modes=0)
    return identify([record.assign_attrs(teeth_driver=32)], settings)


def test_zones_that_are_wrong_never_diverge() -> None:
    """The rig's own D and N, and zones at wrong phases and of three times the width: the error falls all the same.

    Undamped steps end at forty times the error from there.
    """
    short = reference_record(RIG, realisations=1, duration=0.25, band=(2.0, 2600.0), noise=10**-1.5, start_phase=0.3)
    spectra, excited, _ = record_spectra([short], sidebands=40)
    data = class_data(spectra, round(excited[1] / spectra.spacing))
    rig = rig_model(RIG, data)
    zones = Zones((0.1, 0.5), 0.06, 1)
    alone = only_zones(zones, rig.harmonics)
    first = np.linalg.lstsq(alone.functions, rig.vector()[rig.free :], rcond=None)[0]
    shapes = of_zones(zones, alone.of(first), 10)
    amplitudes = np.zeros(shapes.weight.size)
    amplitudes[: first.size] = first
    size = np.select([shapes.group < 0, shapes.group < 2], [1.0, 0.1], 1e-6)
    mesh = Mesh(shapes, amplitudes, shapes.weight / size, amplitudes.size, held=True)
    start = rig.moved(np.concatenate([rig.vector()[: rig.free], mesh.harmonics]))
    found = refined(start, data, mesh=mesh)
    assert output_error(found.model, data) < 0.6 * output_error(start, data)


def test_zones_are_found_and_err_as_expected(record: xr.Dataset, identified: xr.Dataset) -> None:
    """Less than two thirds of what harmonics err by on the same record, with switches where the rig has them."""
    settings = IdentificationSettings("mesh-feedback", 97, band=(800.0, 1600.0), phases=64, step=8, modes=0)
    alone = identify([record], settings)
    exact = exact_itf(RIG.system(1024), identified.frequency.values, identified.phase.values)
    error, of_harmonics = (
        np.linalg.norm(itf(frf).values - exact) / np.linalg.norm(exact) for frf in (identified, alone)
    )
    assert alone.attrs["mesh_basis"] == "harmonics" and identified.attrs["mesh_basis"] == "zones"
    assert error < 0.67 * of_harmonics
    assert 0.67 < identified.attrs["expected_error"] / error < 1.5
    off = (np.sort(np.array(identified.attrs["switch_phases"])) + 0.5) % 1.0 - 0.5
    assert np.abs(np.sort(np.abs(off)) - [0.0, 0.4]).max() < 0.002
    assert identified.attrs["switch_width"] == pytest.approx(0.02, abs=0.003)
    assert identified.attrs["evidence_gain"] > 100 and identified.attrs["mesh_determined"] < 60
    angles = np.array(identified.attrs["switch_angles_driver"])
    assert angles == pytest.approx(np.array(identified.attrs["switch_phases"]) * 2 * np.pi / 32)


def test_stiffness_lies_within_its_band(identified: xr.Dataset) -> None:
    wanted = RIG.stiffness(identified.phase.values)
    apart = (identified.mesh_stiffness.values - wanted) / np.sqrt(identified.mesh_stiffness_var.values)
    assert np.sqrt(np.mean(apart**2)) < 3.0
    assert np.linalg.norm(identified.mesh_stiffness.values - wanted) < 0.01 * np.linalg.norm(wanted)


def test_the_response_at_another_mesh_frequency_is_predicted(record: xr.Dataset) -> None:
    """In zones, from 64 to 150 Hz, against the exact ITF there."""
    settings = IdentificationSettings(
        method="mesh-feedback", band=(800.0, 1600.0), phases=64, step=16, modes=0, mesh_frequency=150.0
    )
    found = identify([record], settings)
    fast = replace(RIG, mesh_frequency=150.0)
    exact = exact_itf(fast.system(1024), found.frequency.values, found.phase.values)
    error = np.linalg.norm(itf(found).values - exact) / np.linalg.norm(exact)
    assert found.attrs["mesh_basis"] == "zones"
    assert error < 0.015 and 0.5 < found.attrs["expected_error"] / error < 2.0


@dataclass(frozen=True)
class FourSwitches(ReferenceRig):
    """A stiffness that rises and falls twice in a mesh cycle."""

    def stiffness(self, phase: ArrayLike) -> NDArray[np.float64]:
        point = np.asarray(phase, dtype=float) % 1.0
        total = np.full(point.shape, 0.7e8)
        for first, second, size in ((0.1, 0.4, 0.35e8), (0.55, 0.8, 0.25e8)):
            rise, fall = (np.clip((point - at) / 0.04 + 0.5, 0.0, 1.0) for at in (first, second))
            total += size * (rise**2 * (3 - 2 * rise) - fall**2 * (3 - 2 * fall))
        return total


def test_four_switches_stay_with_harmonics() -> None:
    """A mesh that changes at four phases is not told by two of them, and errs as harmonics do."""
    rig = FourSwitches(mesh_frequency=64.0)
    record = reference_record(rig, realisations=1, duration=0.5, band=(2.0, 2600.0), noise=0.01, start_phase=0.3)
    settings = IdentificationSettings(method="mesh-feedback", band=(800.0, 1600.0), phases=64, step=16, modes=0)
    found = identify([record], settings)
    assert found.attrs["mesh_basis"] == "harmonics" and "switch_phases" not in found.attrs
    exact = exact_itf(rig.system(1024), found.frequency.values, found.phase.values)
    error = np.linalg.norm(itf(found).values - exact) / np.linalg.norm(exact)
    assert 0.67 < found.attrs["expected_error"] / error < 1.5


@pytest.mark.validation
def test_predicted_deviations_in_zones_are_those_of_repeated_noise() -> None:
    """Twenty draws of noise at 30 dB: predicted over empirical standard deviation of ITF, HTF and k(theta)."""
    clean = reference_record(RIG, realisations=1, duration=0.5, band=(2.0, 2600.0), start_phase=0.3)
    size = 10**-1.5 * float((clean.dte - clean.dte.mean()).std())
    settings = IdentificationSettings(method="mesh-feedback", band=(800.0, 1600.0), phases=32, step=16, modes=0)
    found = []
    for seed in range(20):
        noise = size * np.random.default_rng(seed).standard_normal(clean.dte.shape)
        found.append(identify([clean.assign(dte=clean.dte + noise)], settings))
    assert all(frf.attrs["mesh_basis"] == "zones" for frf in found)
    assert_deviations_are_as_predicted(found)
