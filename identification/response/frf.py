"""The dataset of a time-varying frequency response: ITF, HTF, their variances and the modes, on disk as NetCDF-4."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from gearbench.identification.truth.periodic import Complexes, Floats
from gearbench.records.storage import read_dataset, write_dataset

SCHEMA = "gearbench-frf/1"
KINDS = ("identified", "exact", "frozen")
Kind = Literal["identified", "exact", "frozen"]
VARIABLES: dict[str, tuple[tuple[str, ...], str]] = {
    "itf_re": (("frequency", "phase"), "m/N"),
    "itf_im": (("frequency", "phase"), "m/N"),
    "itf_var": (("frequency", "phase"), "m^2/N^2"),
    "htf_re": (("harmonic", "frequency"), "m/N"),
    "htf_im": (("harmonic", "frequency"), "m/N"),
    "htf_var": (("harmonic", "frequency"), "m^2/N^2"),
    "natural_frequency": (("mode", "phase"), "Hz"),
    "damping_ratio": (("mode", "phase"), "1"),
}
# What a response may hold besides; results of other kinds and older files do not.
OPTIONAL: dict[str, tuple[tuple[str, ...], str]] = {
    "coherence": (("frequency",), "1"),
    "natural_frequency_sd": (("mode", "phase"), "Hz"),
}
# Modes may be missing at a phase.
MAY_BE_NAN = ("natural_frequency", "damping_ratio", "natural_frequency_sd")
COORDINATES = {"frequency": "Hz", "phase": "cycles", "harmonic": "1", "mode": "1"}


class FrfError(ValueError):
    """A dataset that is no frequency response of this schema; the sentence names what is wrong."""


def make_frf(
    kind: Kind,
    *,
    frequency: Floats,
    itf: Complexes,
    htf: Complexes,
    modes: tuple[Floats, Floats],
    itf_variance: Floats | None = None,
    htf_variance: Floats | None = None,
    coherence: Floats | None = None,
    natural_frequency_sd: Floats | None = None,
    attributes: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """The dataset of an ITF (frequency, phase) on uniform phases 0, 1/Q, ... and an HTF (2L+1, frequency), l = -L..L.

    frequency [Hz]; modes: natural frequencies [Hz] and damping ratios, each (mode, phase); variances are
    E|error|^2 and 0 by default; coherence (frequency): part of the response's power that the result explains;
    natural_frequency_sd (mode, phase) [Hz]. Attributes that are None are dropped. Raises FrfError for shapes that do
    not fit.
    """
    limit, phases = htf.shape[0] // 2, itf.shape[1]
    values = {
        "itf_re": itf.real,
        "itf_im": itf.imag,
        "itf_var": np.zeros(itf.shape) if itf_variance is None else itf_variance,
        "htf_re": htf.real,
        "htf_im": htf.imag,
        "htf_var": np.zeros(htf.shape) if htf_variance is None else htf_variance,
        "natural_frequency": modes[0],
        "damping_ratio": modes[1],
    }
    sizes = {"frequency": frequency.size, "phase": phases, "harmonic": 2 * limit + 1, "mode": modes[0].shape[0]}
    coordinates = {
        "frequency": np.asarray(frequency, dtype=float),
        "phase": np.arange(phases) / phases,
        "harmonic": np.arange(-limit, limit + 1),
        "mode": np.arange(modes[0].shape[0]),
    }
    dataset = xr.Dataset(
        _variables(values, sizes),
        coords={name: (name, value, {"units": COORDINATES[name]}) for name, value in coordinates.items()},
        attrs={
            "schema": SCHEMA,
            "kind": kind,
            **{k: v for k, v in (attributes or {}).items() if v is not None},
        },
    )
    for name, more in (("coherence", coherence), ("natural_frequency_sd", natural_frequency_sd)):
        if more is not None:
            dimensions, unit = OPTIONAL[name]
            dataset[name] = (dimensions, np.asarray(more, dtype=float), {"units": unit})
    validate_frf(dataset)
    return dataset


def _variables(values: Mapping[str, Any], sizes: Mapping[str, int]) -> dict[str, Any]:
    """Arrays with their dimensions and units. Raises FrfError for shapes that do not fit."""
    out: dict[str, Any] = {}
    for name, value in values.items():
        dimensions, unit = VARIABLES[name]
        wanted = tuple(sizes[dimension] for dimension in dimensions)
        if value.shape != wanted:
            raise FrfError(f"{name} has shape {value.shape}, but must be {dimensions} = {wanted}")
        out[name] = dimensions, np.ascontiguousarray(value, dtype=float), {"units": unit}
    return out


def validate_frf(dataset: xr.Dataset) -> None:
    """Raise FrfError, in one sentence, if the dataset is not a frequency response of this schema."""
    if dataset.attrs.get("schema") != SCHEMA:
        raise FrfError(f"schema is {dataset.attrs.get('schema')!r}, but a frequency response has {SCHEMA!r}")
    if dataset.attrs.get("kind") not in KINDS:
        raise FrfError(f"kind is {dataset.attrs.get('kind')!r}, but must be one of {', '.join(KINDS)}")
    for name, (dimensions, _) in (VARIABLES | OPTIONAL).items():
        if name not in dataset and name in OPTIONAL:
            continue
        if name not in dataset:
            raise FrfError(f"variable {name} is missing")
        if dataset[name].dims != dimensions:
            raise FrfError(f"variable {name} has dimensions {dataset[name].dims}, not {dimensions}")
        values = dataset[name].values
        if name not in MAY_BE_NAN and not np.isfinite(values).all():
            raise FrfError(f"variable {name} holds values that are not finite")
        if name.endswith("_var") and values.size and values.min() < 0:
            raise FrfError(f"variable {name} holds negative variances")
    for name in COORDINATES:
        if name not in dataset.coords:
            raise FrfError(f"coordinate {name} is missing")
    if not (np.diff(dataset["frequency"].values) > 0).all():
        raise FrfError("coordinate frequency does not rise")


def itf(dataset: xr.Dataset) -> xr.DataArray:
    """Complex ITF (frequency, phase) [m/N].

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=2"]))
    >>> settings = gb.IdentificationSettings(harmonics=8, order=1, window=12, band=(1200.0, 1300.0))
    >>> gb.itf(gb.identify([record], settings)).dims
    ('frequency', 'phase')
    """
    return (dataset["itf_re"] + 1j * dataset["itf_im"]).rename("itf")


def htf(dataset: xr.Dataset) -> xr.DataArray:
    """Complex HTF (harmonic, frequency) [m/N].

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=2"]))
    >>> settings = gb.IdentificationSettings(harmonics=8, order=1, window=12, band=(1200.0, 1300.0))
    >>> gb.htf(gb.identify([record], settings)).sizes["harmonic"]
    17
    """
    return (dataset["htf_re"] + 1j * dataset["htf_im"]).rename("htf")


def write_frf(dataset: xr.Dataset, path: str | Path) -> None:
    """Validate and write as NetCDF-4; `path` is replaced in one step. Raises FrfError and FileError.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=2"]))
    >>> settings = gb.IdentificationSettings(harmonics=8, order=1, window=12, band=(1200.0, 1300.0))
    >>> gb.write_frf(gb.identify([record], settings), "frf.nc")
    """
    validate_frf(dataset)
    write_dataset(dataset, path)


def read_frf(path: str | Path) -> xr.Dataset:
    """Read into memory and validate. Raises FrfError for a missing, broken or unfit file.

    >>> import gearbench as gb
    >>> gb.read_frf("none.nc")
    Traceback (most recent call last):
    gearbench.identification.response.frf.FrfError: frequency response none.nc does not exist
    """
    dataset = read_dataset(path, "frequency response", FrfError)
    try:
        validate_frf(dataset)
    except FrfError as error:
        raise FrfError(f"{path}: {error}") from None
    return dataset
