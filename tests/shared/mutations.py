"""Seeded damage: settings of cases, and bytes, attributes and channels of records."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearbench.rig import Case, dump_case

Rng = np.random.Generator

ODD: tuple[str, ...] = (
    "0", "-1", "1", "2", "3", "nan", "inf", "-inf", "1e-300", "1e300", "true", '""', '"x"', "[]", "[1, 2]", "{}",
    "1e999", "[1, 2, 3, 4, 5, 6]", "{ value = 1, sd = 0.1 }", "{ value = 1, sd = -1 }", "9" * 400, "1979-05-27",
    "'/dev/zero'", "[nan]", "[[1]]", '"speed"', '"torque"', "-0.0", "0x10", "", "=", "\x00", "é",
)  # fmt: skip
FACTORS = (-1.0, 0.0, 1e-6, 1e-3, 0.1, 0.5, 0.9, 0.99, 1.01, 1.1, 1.5, 2.0, 3.0, 10.0, 1e3, 1e6)


def leaves(case: Case) -> dict[str, Any]:
    """Every key of a case by its dotted name, and its value as TOML gives it."""
    found: dict[str, Any] = {}

    def walk(table: Any, where: str) -> None:
        for key, value in table.items() if isinstance(table, dict) else enumerate(table):
            if isinstance(value, dict) or (isinstance(value, list) and value and isinstance(value[0], dict)):
                walk(value, f"{where}{key}.")
            else:
                found[f"{where}{key}"] = value

    walk(tomllib.loads(dump_case(case)), "")
    return found


def settings(rng: Rng, known: dict[str, Any]) -> list[str]:
    """One to three `--set` texts: numbers scaled, values exchanged for odd ones, names misspelt."""
    made = []
    for _ in range(rng.integers(1, 4)):
        key = str(rng.choice(list(known)))
        value = known[key]
        kind = rng.random()
        if kind < 0.6 and isinstance(value, int | float) and not isinstance(value, bool):
            scaled = value * float(rng.choice(FACTORS))
            text = str(round(scaled)) if isinstance(value, int) and abs(scaled) < 1e9 else repr(scaled)
        elif kind < 0.85:
            text = str(rng.choice(np.array(ODD, dtype=object)))
        elif kind < 0.95:
            text = repr(float(10 ** rng.uniform(-9, 9)))
        else:
            place = int(rng.integers(len(key)))
            key, text = key[:place] + chr(rng.integers(33, 127)) + key[place + 1 :], "1"
        made.append(f"{key}={text}")
    return made


def damage_bytes(rng: Rng, content: bytes) -> bytes:
    """Bytes changed, cut out, repeated or cut off."""
    hurt = bytearray(content)
    for _ in range(int(rng.integers(1, 8))):
        # HDF5 keeps most of what it must understand at the beginning and the end.
        near = int(rng.integers(min(len(hurt), 16_384)))
        place = near if rng.random() < 0.6 else len(hurt) - 1 - near if rng.random() < 0.5 else rng.integers(len(hurt))
        kind = rng.random()
        if kind < 0.7:
            hurt[place] = int(rng.integers(256))
        elif kind < 0.8:
            hurt[place : place + int(rng.integers(1, 64))] = b""
        elif kind < 0.9:
            hurt[place:place] = hurt[place : place + int(rng.integers(1, 64))]
        else:
            del hurt[max(int(place), 1) :]
    return bytes(hurt)


def damage_attributes(rng: Rng, record: xr.Dataset) -> xr.Dataset:
    """One to three attributes left out or given an odd value."""
    hurt = record.copy()
    odd: list[Any] = [0, -1, 1e-300, 1e300, np.nan, np.inf, "", "x", "1", np.zeros(3), np.arange(2), "speed", 2**40]
    for _ in range(rng.integers(1, 4)):
        key = str(rng.choice([str(name) for name in hurt.attrs]))
        kind = rng.random()
        value = hurt.attrs[key]
        if kind < 0.2:
            del hurt.attrs[key]
        elif kind < 0.6 and isinstance(value, int | float | np.number):
            hurt.attrs[key] = float(value) * float(rng.choice(FACTORS))
        else:
            hurt.attrs[key] = odd[int(rng.integers(len(odd)))]
    return hurt


def damage_channels(rng: Rng, record: xr.Dataset) -> xr.Dataset:
    """A channel without meaning: constant, of NaN, scaled, shifted, clipped, renamed, left out, of another type."""
    hurt = record.copy(deep=True)
    name = str(rng.choice([str(one) for one in hurt.data_vars]))
    values = hurt[name].values
    kind = int(rng.integers(9))
    if kind == 0:
        values[...] = float(rng.choice([0.0, 1.0, -1e9]))
    elif kind == 1:
        values[0, int(rng.integers(values.shape[1]))] = float(rng.choice([np.nan, np.inf]))
    elif kind == 2:
        values *= float(rng.choice(FACTORS))
    elif kind == 3:
        values[...] = np.roll(values, int(rng.integers(1, values.shape[1])), axis=1)
    elif kind == 4:
        values[...] = np.clip(values, *np.quantile(values, [0.2, 0.8]))
    elif kind == 5:
        hurt = hurt.rename({name: f"{name}_x"})
    elif kind == 6:
        hurt = hurt.drop_vars(name)
    elif kind == 7:
        hurt[name] = hurt[name].astype(str(rng.choice(["float32", "int32", "int8"])))
    else:
        hurt = hurt.isel(time=slice(0, int(rng.integers(0, 50))))
    return hurt


def damaged_record(rng: Rng, record: xr.Dataset, content: bytes, path: Path) -> str:
    """Write a damaged record; what was done to it."""
    kind = int(rng.integers(3))
    if kind == 0:
        path.write_bytes(damage_bytes(rng, content))
        return "bytes"
    made = (damage_attributes, damage_channels)[kind - 1](rng, record)
    made.to_netcdf(path, engine="h5netcdf", encoding={str(v): {"_FillValue": None} for v in made.variables})
    return "attributes" if kind == 1 else "channels"
