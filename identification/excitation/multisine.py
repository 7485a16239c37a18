"""Random-phase multisines with flat amplitude and a clipped crest factor.

Phases are drawn at random and then moved by alternating projection (Van der Ouderaa, Schoukens and
Renneboog, IEEE Trans. Instrum. Meas. 37, 1988): clip the signal in time, keep the phases of its lines,
restore the flat amplitude. Schroeder phases are refused: shifted copies of a chirp are nearly dependent,
which makes the regression of a periodically time-varying system singular.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Grid = Literal["full", "odd", "comb", "coset"]

CLIPPING_ROUNDS = 400
# Fresh random phases where clipping stalls, as it does with few lines.
STARTS = 8
# Points per period of the highest line: coarse and fine clipping, and where the peak is measured.
CLIPPING_POINTS = (4, 8)
PEAK_POINTS = 32
# How far above the wanted crest factor the result may end.
CREST_SLACK = 1.02
# A coset has at least so many lines to the mesh frequency: classes 0, +-1, +-2, +-3 and 4 are then apart.
COSET_LEAST = 8
# ... and asks for no lower crest factor than this: on its few lines clipping stalls at 1.8 to 1.9.
COSET_CREST = 1.95
# Of so many neighbouring lines of a coset, one drawn at random stays silent.
COSET_GROUP = 4


class MultisineError(ValueError):
    """A multisine that cannot be made; the sentence names the value and the limit."""


@dataclass(frozen=True)
class MultisineSignal:
    """One period of a multisine, u(t) = Re sum_k spectrum_k exp(2 pi j lines_k t / period).

    `lines` (K,) are multiples of 1/period, `spectrum` (K,) complex amplitudes in the signal's unit;
    `samples` points a period at `sampling_rate` [Hz]. Arrays are read-only.
    """

    samples: int
    sampling_rate: float
    lines: NDArray[np.int64]
    spectrum: NDArray[np.complex128]

    def __post_init__(self) -> None:
        for value in (self.lines, self.spectrum):
            value.setflags(write=False)

    @property
    def period(self) -> float:
        """Period [s]."""
        return self.samples / self.sampling_rate

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies of the lines [Hz]."""
        return self.lines / self.period

    @property
    def rms(self) -> float:
        """Root mean square."""
        return float(np.sqrt(0.5 * np.sum(np.abs(self.spectrum) ** 2)))

    @property
    def peak(self) -> float:
        """Largest magnitude of the continuous signal (to 0.5 % of the highest line's amplitude share)."""
        return float(np.abs(self.sample(_points(int(self.lines[-1]), PEAK_POINTS))).max())

    @property
    def crest(self) -> float:
        """Crest factor: peak over rms."""
        return self.peak / self.rms

    def sample(self, n: int, *, shift: float = 0.0) -> NDArray[np.float64]:
        """The trigonometric sum, exact, at n equidistant points of one period: t = (i / n + shift) period.

        n must exceed twice the highest line (MultisineError), or the points could not carry the signal.
        """
        highest = int(self.lines[-1])
        if n <= 2 * highest:
            raise MultisineError(f"{n} points a period cannot carry line {highest}; more than {2 * highest} can")
        from scipy.fft import irfft

        bins = np.zeros(n // 2 + 1, dtype=complex)
        bins[self.lines] = 0.5 * n * self.spectrum * np.exp(2j * np.pi * self.lines * shift)
        return irfft(bins, n)


def random_phase_multisine(
    samples: int,
    sampling_rate: float,
    band: tuple[float, float],
    *,
    amplitude: float | None = None,
    rms: float | None = None,
    grid: Grid = "full",
    crest: float = 1.7,
    phases: str = "random",
    modulus: int = 0,
    residue: int = 0,
    rng: np.random.Generator,
) -> MultisineSignal:
    """A multisine of equal amplitudes on the lines of `grid` inside `band` [Hz], crest factor at most about `crest`.

    `samples` points a period at `sampling_rate` [Hz]; either `amplitude` (peak of the whole multisine) or
    `rms` sets its size. Grid "full": every line of the band but 0; "odd": the odd ones; "comb": those that are
    +-`residue` modulo `modulus` (see identification.comb); "coset": those that are +-1 modulo `modulus`, the lines to
    the mesh frequency, of which one in COSET_GROUP, drawn at random, is left out. `phases` other than "random" are
    refused. Raises MultisineError for an empty or unsampled band, sizes that are not positive, or a crest factor that
    this number of lines cannot reach.
    """
    if phases != "random":
        raise MultisineError(
            f"phases = {phases!r} is refused: only random phases keep shifted spectra independent"
            " (Schroeder phases give the time-varying regression a condition number near 1e12)"
        )
    if (amplitude is None) == (rms is None):
        raise MultisineError("give exactly one of amplitude and rms of the multisine")
    size = amplitude if amplitude is not None else rms
    if not size or not np.isfinite(size) or size < 0:
        raise MultisineError(f"the size of the multisine, {size!r}, must be positive")
    lines = excited_lines(samples, sampling_rate, band, grid, modulus, residue)
    if grid == "coset":
        lines, crest = _thinned(lines, rng), max(crest, COSET_CREST)
    signal = _lowest_crest(samples, sampling_rate, lines, crest, rng)
    peak = signal.peak
    if peak > CREST_SLACK * crest * signal.rms:
        raise MultisineError(
            f"crest = {crest:g} cannot be reached with {lines.size} line(s) in {band[0]:g}-{band[1]:g} Hz;"
            f" the best found is {peak / signal.rms:.3g}"
        )
    scale = size / (peak if amplitude is not None else signal.rms)
    return MultisineSignal(samples, sampling_rate, lines, signal.spectrum * scale)


def _lowest_crest(
    samples: int, sampling_rate: float, lines: NDArray[np.int64], crest: float, rng: np.random.Generator
) -> MultisineSignal:
    """Unit amplitudes with the first phases that reach the crest factor, else the best of all starts."""
    best: MultisineSignal | None = None
    for _ in range(STARTS):
        signal = MultisineSignal(samples, sampling_rate, lines, _clip(lines, crest, rng))
        if best is None or signal.crest < best.crest:
            best = signal
        if signal.crest <= CREST_SLACK * crest:
            break
    assert best is not None
    return best


def excited_lines(
    samples: int, sampling_rate: float, band: tuple[float, float], grid: Grid, modulus: int = 0, residue: int = 0
) -> NDArray[np.int64]:
    """Lines (multiples of sampling_rate / samples) inside `band` [Hz] that the grid excites; never line 0.

    `modulus` belongs to grids "comb" and "coset" (even there), `residue` to "comb". Raises MultisineError.
    """
    if grid not in ("full", "odd", "comb", "coset"):
        raise MultisineError(f"grid = {grid!r} is unknown; grids are 'full', 'odd', 'comb' and 'coset'")
    if grid == "coset" and (modulus < COSET_LEAST or modulus % 2):
        raise MultisineError(
            f"a coset of {modulus} lines to the mesh frequency must have an even number of at least {COSET_LEAST}"
        )
    if grid == "comb" and not 0 < 2 * residue < modulus:
        raise MultisineError(f"residue = {residue} of a comb must lie between 1 and half of its modulus = {modulus}")
    low, high = band
    if not (0 <= low <= high < sampling_rate / 2):
        raise MultisineError(
            f"band {low:g}-{high:g} Hz must rise and lie between 0 and half the sampling rate, {sampling_rate / 2:g} Hz"
        )
    spacing = sampling_rate / samples
    first, last = int(np.ceil(low / spacing - 1e-9)), int(np.floor(high / spacing + 1e-9))
    lines = np.arange(max(first, 1), last + 1)
    if grid == "odd":
        lines = lines[lines % 2 == 1]
    elif grid in ("comb", "coset"):
        residue = residue if grid == "comb" else 1
        lines = lines[(lines % modulus == residue) | (lines % modulus == modulus - residue)]
    if not lines.size:
        raise MultisineError(f"band {low:g}-{high:g} Hz holds no line of grid {grid!r}; lines are {spacing:g} Hz apart")
    return lines


def _thinned(lines: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.int64]:
    """Lines without one of each COSET_GROUP neighbours, drawn at random (random harmonic grid; Pintelon and Schoukens
    2012, section 4.3): each realisation then leaves other lines out."""
    groups = lines.size // COSET_GROUP
    silent = np.arange(groups) * COSET_GROUP + rng.integers(COSET_GROUP, size=groups)
    return np.asarray(np.delete(lines, silent))


def _points(highest: int, per_period: int) -> int:
    from scipy.fft import next_fast_len

    return int(next_fast_len(per_period * highest, real=True))


def _clip(lines: NDArray[np.int64], crest: float, rng: np.random.Generator) -> NDArray[np.complex128]:
    """Unit amplitudes whose phases give the lowest crest factor found, stopping once it is below `crest`."""
    spectrum = np.exp(2j * np.pi * rng.random(lines.size))
    for per_period in CLIPPING_POINTS:
        spectrum = _clip_on_grid(lines, spectrum, crest, _points(int(lines[-1]), per_period))
    return spectrum


def _clip_on_grid(
    lines: NDArray[np.int64], spectrum: NDArray[np.complex128], crest: float, points: int
) -> NDArray[np.complex128]:
    """One run of alternating projections with the signal seen at `points` points a period."""
    from scipy.fft import irfft, rfft

    bins = np.zeros(points // 2 + 1, dtype=complex)
    rms = np.sqrt(0.5 * lines.size)
    best, lowest = spectrum, np.inf
    for _ in range(CLIPPING_ROUNDS):
        bins[lines] = 0.5 * points * spectrum
        signal = irfft(bins, points)
        reached = float(np.abs(signal).max()) / rms
        if reached < lowest:
            best, lowest = spectrum, reached
        if reached <= crest:
            break
        # Relative to the present peak at first, below the wanted one later: the rounds do not stall.
        level = max(0.7 * reached, 0.85 * crest) * rms
        moved = rfft(np.clip(signal, -level, level))[lines]
        spectrum = moved / np.maximum(np.abs(moved), np.finfo(float).tiny)
    return best
