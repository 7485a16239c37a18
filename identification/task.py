"""What is to be identified: the settings, and everything that both methods need of the records."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.spectra.joint import Spectra

Progress = Callable[[float, str], None]

# About this many output frequencies unless a step is given.
OUTPUT_LINES = 1500
METHODS = ("lpm", "mesh-feedback")
BRANCHES = ("auto", "polynomials", "smooth")


@dataclass(frozen=True)
class IdentificationSettings:
    """How to identify. None: chosen from the record.

    method "lpm", the local polynomial method: `harmonics` L (branches on each side), `order` R, `window` n
    (half-width in lines); or "mesh-feedback": `harmonics` of the mesh stiffness, order and window unused; `band`
    [Hz]: output frequencies (default: the excited band); `step`: lines between them; `phases`: of the ITF;
    `transient`: "estimate" polynomials for it, "none", or "auto": only where the record does not prove its
    steady state; `modes`: at most that many; `branches` of the local method "lpm": "polynomials" in each window,
    "smooth" random functions, or "auto": whichever predicts the lesser error (polynomials where any of L, R, n is
    given); `mesh_frequency` [Hz] of "mesh-feedback": predict the response there (default: at the record's);
    `accept_doubts`: a doubtful channel, or a result that is expected to say nothing, is warned of and not refused.
    """

    method: Literal["lpm", "mesh-feedback"] = "lpm"
    harmonics: int | None = None
    order: int | None = None
    window: int | None = None
    band: tuple[float, float] | None = None
    step: int | None = None
    phases: int = 256
    transient: Literal["auto", "estimate", "none"] = "auto"
    modes: int | None = None
    branches: Literal["auto", "polynomials", "smooth"] = "auto"
    mesh_frequency: float | None = None
    accept_doubts: bool = False

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise LpmError(f"method = {self.method!r} is unknown; methods are 'lpm' and 'mesh-feedback'")
        for name in ("order", "window"):
            if self.method != "lpm" and getattr(self, name) is not None:
                raise LpmError(f"{name} = {getattr(self, name)} belongs to method 'lpm', not to {self.method!r}")
        if self.branches not in BRANCHES:
            raise LpmError(f"branches = {self.branches!r} must be 'auto', 'polynomials' or 'smooth'")
        if self.branches != "auto" and self.method != "lpm":
            raise LpmError(f"branches = {self.branches!r} belongs to method 'lpm', not to {self.method!r}")
        if self.mesh_frequency is not None and self.method != "mesh-feedback":
            raise LpmError(
                f"mesh_frequency = {self.mesh_frequency:g} belongs to method 'mesh-feedback': branches of"
                f" {self.method!r} hold at the record's own only"
            )
        if self.mesh_frequency is not None and not 0 < self.mesh_frequency < np.inf:
            raise LpmError(f"mesh_frequency = {self.mesh_frequency:g} Hz must be positive and finite")
        for name in ("order", "window"):
            if self.branches == "smooth" and getattr(self, name) is not None:
                raise LpmError(f"{name} = {getattr(self, name)} belongs to branches = 'polynomials', not to 'smooth'")
        if self.transient not in ("auto", "estimate", "none"):
            raise LpmError(f"transient = {self.transient!r} must be 'auto', 'estimate' or 'none'")
        limits = {"harmonics": 0, "order": 0, "window": 1, "step": 1, "phases": 1, "modes": 0}
        for name, least in limits.items():
            value = getattr(self, name)
            if value is not None and value < least:
                raise LpmError(f"{name} = {value} must be at least {least}")
        if self.order and self.window and self.order > 2 * self.window:
            raise LpmError(f"order = {self.order} needs window = {self.window} of at least {-(-self.order // 2)}")
        if self.band is not None and not 0 <= self.band[0] < self.band[1]:
            raise LpmError(f"band = {self.band[0]:g}-{self.band[1]:g} Hz must rise from at least 0")


@dataclass(frozen=True)
class Task:
    """`spectra` of the records, whose force covers the band `excited` [Hz]; the output `lines`; `settings`; `notes`
    that become warnings; `record_error`: what doubtful channels may cost; `report(fraction, message)`."""

    spectra: Spectra
    lines: NDArray[np.int64]
    settings: IdentificationSettings
    excited: tuple[float, float]
    notes: tuple[str, ...]
    record_error: float
    report: Progress

    def part(self, first: float, share: float) -> Progress:
        """Reports of a step that begins at the fraction `first` and takes a `share`."""
        return lambda part, message: self.report(first + share * part, message)

    def attributes(self) -> dict[str, Any]:
        """Attributes of the result that say what was asked for, and of what."""
        return attributes_of(self.settings, self.spectra)

    def first_realisations(self, count: int) -> Task:
        """The same of the first realisations only."""
        kept = replace(
            self.spectra,
            force=self.spectra.force[:count],
            dte=self.spectra.dte[:count],
            start_phase=self.spectra.start_phase[:count],
        )
        return replace(self, spectra=kept)


def attributes_of(settings: IdentificationSettings, spectra: Spectra) -> dict[str, Any]:
    """Attributes of a result that say what was asked for, and of what."""
    return {
        "method": settings.method,
        "settings": json.dumps(asdict(settings)),
        "mesh_frequency": spectra.mesh_lines * spectra.spacing,
        "mesh_lines": spectra.mesh_lines,
        "realisations": spectra.realisations,
        "joint_period": spectra.duration,
        "periods_averaged": spectra.periods,
    }


def output_lines(
    spectra: Spectra, band: tuple[float, float], excited: tuple[float, float], step: int | None
) -> NDArray[np.int64]:
    """Output lines inside the band: multiples of `step`, by default about OUTPUT_LINES of them.

    A step that divides d, or is a multiple of it, lets branches share rows. Raises LpmError for a band that
    the record does not excite.
    """
    spacing, d = spectra.spacing, spectra.mesh_lines
    slack = 1e-9 + 2.0  # the outermost lines may just miss a round band limit
    if band[0] < excited[0] - slack * spacing or band[1] > excited[1] + slack * spacing:
        raise LpmError(f"band {band[0]:g}-{band[1]:g} Hz leaves the excited band {excited[0]:g}-{excited[1]:g} Hz")
    first = max(1, int(np.ceil(max(band[0], excited[0]) / spacing - 1e-6)))
    last = int(np.floor(min(band[1], excited[1]) / spacing + 1e-6))
    if step is None:
        wanted = max(1, (last - first + 1) // OUTPUT_LINES)
        step = max(s for s in range(1, wanted + 1) if d % s == 0 or s % d == 0)
    lines = np.arange(-(-first // step) * step, last + 1, step)
    if lines.size < 3:
        raise LpmError(
            f"band {band[0]:g}-{band[1]:g} Hz holds {lines.size} line(s) at a step of {step * spacing:g} Hz; at least 3"
            " are needed"
        )
    return lines
