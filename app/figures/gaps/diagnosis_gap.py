"""How far the gap shrinks: from the nominal rig over the recalibrated one to the one with the effect."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.figures.plotting import BLUE, GREEN, GREY, ORANGE, figure, log_ticks, save
from gearbench.words.diagnosis import CHANNELS, STAGE_WORDS, STAGES, whole_band
from gearbench.words.diagnosis import number as number_of

if TYPE_CHECKING:
    from gearbench.diagnosis.replay.traces import Traces
    from gearbench.diagnosis.verdict import Gap

Array = NDArray[np.float64]

COLOURS = {"nominal": ORANGE, "recalibrated": BLUE, "with_effect": GREEN, "floor": GREY}
MARKS = {"nominal": "s", "recalibrated": "o", "with_effect": "D", "floor": "|"}
# Curves that lie on one another all stay visible.
WIDTHS = (3.0, 1.8, 1.1)
# Bands of an octave in the spectrum of the gap.
PER_OCTAVE = 6
HEAD = 0.15  # of the decades that it spans, what is left above it for a legend


def draw_gap(path: Path, gaps: Sequence[Gap], record: str) -> None:
    """Rms gap of each channel over the whole band, relative to that of the nominal rig, with its interval."""
    shown = [gap for gap in whole_band(gaps) if gap.nominal.value > 0]
    with figure(1, 1, (8.5, 1.3 + 0.5 * len(shown))) as (drawing, axes):
        seen: set[str] = set()
        for row, gap in enumerate(reversed(shown)):
            for number, stage in enumerate(STAGES):
                found = getattr(gap, stage)
                if found is None or found.value <= 0:
                    continue
                scale, y = gap.nominal.value, row + 0.18 * (1.5 - number)
                axes.errorbar(
                    found.value / scale,
                    y,
                    xerr=[[(found.value - found.low) / scale], [(found.high - found.value) / scale]],
                    fmt=MARKS[stage],
                    markersize=9 if stage == "floor" else 5,
                    color=COLOURS[stage],
                    capsize=2.5,
                    label=None if stage in seen else STAGE_WORDS[stage],
                )
                seen.add(stage)
        axes.set_yticks(range(len(shown)), [CHANNELS.get(gap.channel, gap.channel) for gap in reversed(shown)])
        axes.set_ylim(-0.6, len(shown) - 0.4)
        axes.set_xscale("log")
        _plain_ticks(axes)
        axes.set_xlabel(f"rms gap on record {record}, relative to that of the nominal rig (bars: 90 %)")
        drawing.legend(loc="outside upper center", ncols=4)
        save(drawing, path)


def _plain_ticks(axes: Any) -> None:
    """Ticks at 1, 2, 5 in each decade, written as plain numbers; the range spans at least one decade."""
    low, high = axes.get_xlim()
    if high < 10 * low:
        low = high / 10
    axes.set_xlim(low, high)
    log_ticks(axes.xaxis, low, high)


def draw_traces(path: Path, traces: Traces) -> None:
    """Measured minus simulated over six mesh periods, and its spectrum."""
    micro = 1e6 if traces.unit == "m" else 1.0
    unit = "um" if traces.unit == "m" else traces.unit
    name = CHANNELS.get(traces.channel, traces.channel)
    with figure(2, 1, (9.0, 6.6)) as (drawing, (above, below)):
        count = min(traces.measured.size, round(6 * traces.rate / traces.mesh))
        cycles = np.arange(count) * traces.mesh / traces.rate
        for number, (stage, values) in enumerate(traces.simulated.items()):
            rest = _moving(traces.measured - values)[:count]
            above.plot(cycles, micro * rest, color=COLOURS[stage], linewidth=WIDTHS[number], label=STAGE_WORDS[stage])
        above.set_xlim(0, cycles[-1])
        above.set_xlabel("mesh periods from the start of the record")
        above.set_ylabel(f"difference [{unit}]")
        size = number_of(micro * float(traces.measured.std()))
        above.set_title(f"Measured minus simulated, without its mean: {name} (its own rms is {size} {unit})")
        above.margins(y=0.2)
        above.legend(loc="upper right", ncols=3)
        _spectra(below, traces, micro, unit)
        save(drawing, path)


def _spectra(axes: Any, traces: Traces, micro: float, unit: str) -> None:
    for number, (stage, values) in enumerate(traces.simulated.items()):
        centre, rms = octave_bands(_line_rms(traces.measured - values), traces.rate / traces.measured.size)
        axes.plot(centre, micro * rms, color=COLOURS[stage], linewidth=WIDTHS[number], label=STAGE_WORDS[stage])
    if traces.noise is not None:
        centre, rms = octave_bands(traces.noise, traces.rate / traces.measured.size)
        axes.plot(centre, micro * rms, color=GREY, linestyle=":", label=STAGE_WORDS["floor"])
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"rms per 1/{PER_OCTAVE} octave [{unit}]")
    axes.set_title("Spectrum of the difference")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** HEAD)
    axes.legend(loc="upper left", ncols=4)


def octave_bands(lines: Array, spacing: float) -> tuple[Array, Array]:
    """Centres (B,) [Hz] and rms (B,) of line rms values (lines,) over bands of 1/6 octave.

    Bands without a line, and the last one, which the Nyquist frequency cuts, are left out.
    """
    frequency = np.arange(lines.size) * spacing
    band = np.round(PER_OCTAVE * np.log2(np.maximum(frequency, spacing) / spacing)).astype(int)
    energy = np.bincount(band[1:], weights=lines[1:] ** 2)
    held = np.bincount(band[1:]) > 0
    held[-1] = False
    centres = spacing * 2.0 ** (np.arange(energy.size) / PER_OCTAVE)
    return centres[held], np.sqrt(energy[held])


def _line_rms(values: Array) -> Array:
    """Rms of each line of a real signal (N,): squares add up to its mean square."""
    spectrum = np.abs(np.fft.rfft(values)) / values.size
    spectrum[1 : (values.size + 1) // 2] *= np.sqrt(2)
    return spectrum


def _moving(values: Array) -> Array:
    return values - values.mean()
