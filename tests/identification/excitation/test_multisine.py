"""Multisines: peak, crest factor, lines, exact resampling, refusals."""

import numpy as np
import pytest

from gearbench.identification.excitation.multisine import MultisineError, MultisineSignal, random_phase_multisine


def make(grid: str = "full", seed: int = 0, **changes: object) -> MultisineSignal:
    settings: dict = {"amplitude": 50.0, "grid": grid, "rng": np.random.default_rng(seed), **changes}
    return random_phase_multisine(4096, 4096.0, (10.0, 900.0), **settings)


@pytest.mark.parametrize("grid", ["full", "odd"])
def test_lines_are_flat_and_where_the_grid_wants_them(grid: str) -> None:
    signal = make(grid)
    spectrum = np.fft.rfft(signal.sample(4096)) / 2048
    lines = np.arange(10, 901)
    wanted = lines if grid == "full" else lines[lines % 2 == 1]
    rest = np.delete(spectrum, wanted)
    magnitude = np.abs(spectrum[wanted])
    assert np.ptp(magnitude) < 1e-12 * magnitude.max()
    assert np.abs(rest).max() < 1e-12 * magnitude.max()


@pytest.mark.parametrize("seed", range(4))
def test_amplitude_is_the_peak_of_the_whole_and_crest_is_low(seed: int) -> None:
    signal = make(seed=seed)
    fine = signal.sample(1 << 17)
    assert np.abs(fine).max() == pytest.approx(50.0, rel=5e-3)
    assert np.abs(fine).max() / fine.std() < 1.75
    # Phases stay spread over the circle: no chirp, no pulse.
    assert abs(np.mean(signal.spectrum / np.abs(signal.spectrum))) < 0.2


def test_rms_sets_the_size() -> None:
    signal = make(amplitude=None, rms=3.0)
    assert signal.sample(8192).std() == pytest.approx(3.0, rel=1e-12)


def test_sampling_is_the_trigonometric_sum() -> None:
    signal = make()
    time = np.arange(10000) / 10000
    instants = np.array([0, 17, 4321, 9999])
    turn = np.exp(2j * np.pi * np.outer(time[instants] + 0.3 / 10000, signal.lines))
    assert signal.sample(10000, shift=0.3 / 10000)[instants] == pytest.approx((turn @ signal.spectrum).real, rel=1e-10)
    assert signal.sample(8192)[::2] == pytest.approx(signal.sample(4096), abs=1e-11)


def test_realisations_differ_and_repeat_with_their_seed() -> None:
    assert np.array_equal(make(seed=1).spectrum, make(seed=1).spectrum)
    assert not np.allclose(make(seed=1).spectrum, make(seed=2).spectrum)
    with pytest.raises(ValueError, match="read-only"):
        make().spectrum[0] = 0.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"phases": "schroeder"}, "schroeder.*random phases"),
        ({"rms": 1.0}, "exactly one of amplitude and rms"),
        ({"amplitude": -1.0}, "-1.0.*positive"),
        ({"amplitude": float("nan")}, "nan.*positive"),
        ({"grid": "even"}, "even.*'full', 'odd', 'comb' and 'coset'"),
        ({"crest": 1.2}, "crest = 1.2 cannot be reached with 891 line"),
    ],
)
def test_refusals_name_the_value(changes: dict, words: str) -> None:
    with pytest.raises(MultisineError, match=words):
        make(**changes)


@pytest.mark.parametrize(
    ("band", "words"),
    [((10.0, 2048.0), "2048 Hz"), ((900.0, 10.0), "rise"), ((0.1, 0.4), "no line.*1 Hz apart")],
)
def test_bands_that_cannot_be(band: tuple[float, float], words: str) -> None:
    with pytest.raises(MultisineError, match=words):
        random_phase_multisine(4096, 4096.0, band, amplitude=1.0, rng=np.random.default_rng(0))


def test_too_few_points_to_sample() -> None:
    with pytest.raises(MultisineError, match=r"1800 points.*line 900"):
        make().sample(1800)


def test_a_comb_excites_the_lines_of_its_residue_only() -> None:
    signal = make("comb", modulus=50, residue=7, crest=2.0, amplitude=3.0)
    spectrum = np.abs(np.fft.rfft(signal.sample(4096))) / 2048
    wanted = [line for line in range(10, 901) if line % 50 in (7, 43)]
    assert signal.lines.tolist() == wanted
    assert np.ptp(spectrum[wanted]) < 1e-12 and np.delete(spectrum, wanted).max() < 1e-12
    for residue, modulus in ((0, 50), (25, 50), (7, 0), (-7, 50)):
        with pytest.raises(MultisineError, match=f"residue = {residue} .*modulus = {modulus}"):
            make("comb", modulus=modulus, residue=residue)


def test_clipping_that_stalls_starts_again() -> None:
    # With this seed the first phases of these 119 lines stall at a crest factor of 2.04.
    comb = {"grid": "comb", "modulus": 60, "residue": 13, "crest": 2.0, "amplitude": 1.0}
    draw = np.random.default_rng(130)
    signal = random_phase_multisine(12288, 10240.0, (20.0, 3000.0), rng=draw, **comb)
    assert signal.crest < 2.04
