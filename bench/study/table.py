"""The table of a study: one row a member, one column a factor or number, units with each, as dataset and as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from gearbench.bench.study.design import Design
from gearbench.bench.study.quantities import Column

SCHEMA = "gearbench-study/1"


def study_dataset(
    design: Design,
    columns: Sequence[Column],
    numbers: Sequence[Mapping[str, float]],
    sentences: Sequence[str],
    warnings: Sequence[Sequence[str]],
    attributes: Mapping[str, object],
) -> xr.Dataset:
    """Variables over `member`: each factor by its key, each number by its column (NaN where a member failed),
    `sentence` (why it failed, else empty) and `warnings`. Attributes `units`, `long_name`, `role`: factor or result."""
    variables: dict[str, tuple[tuple[str], object, dict[str, str]]] = {}
    for place, factor in enumerate(design.factors):
        texts = [row[place] for row in design.members]
        values: object = np.array([float(text) for text in texts]) if factor.numeric else np.array(texts, dtype=object)
        unit = factor.key.unit or ("1" if factor.numeric else "")
        about = {"units": unit, "long_name": factor.key.words, "role": "factor"}
        variables[factor.name] = (("member",), values, about)
    for column in columns:
        held = np.array([row.get(column.name, np.nan) for row in numbers])
        about = {"units": column.unit, "long_name": column.words, "role": "result"}
        variables[column.name] = (("member",), held, about)
    said = np.array(list(sentences), dtype=object)
    variables["sentence"] = (("member",), said, {"long_name": "why the member failed", "role": "note"})
    doubts = np.array(["; ".join(one) for one in warnings], dtype=object)
    variables["warnings"] = (("member",), doubts, {"long_name": "what to mind", "role": "note"})
    coordinates = {"member": ("member", np.arange(len(design.members)), {"long_name": "number of the member"})}
    about_all = {"schema": SCHEMA, "sample": design.sample, "base_points": design.base, **attributes}
    return xr.Dataset(variables, coords=coordinates, attrs=about_all)


def named(dataset: xr.Dataset, role: str) -> list[str]:
    """Names of the variables of that role, in order."""
    return [str(name) for name, held in dataset.data_vars.items() if held.attrs.get("role") == role]


def csv_text(dataset: xr.Dataset) -> str:
    """The table as CSV. Numbers are as exact as they are held; the name of a column carries its unit."""
    names = [*named(dataset, "factor"), *named(dataset, "result"), *named(dataset, "note")]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["member", *names])
    for row in range(dataset.sizes["member"]):
        writer.writerow([row, *(_cell(dataset[name].values[row]) for name in names)])
    return out.getvalue()


def _cell(value: object) -> str:
    """Text as it is; a number in as few digits as hold it; nothing for one that is missing."""
    if isinstance(value, str):
        return value
    number = float(value)  # type: ignore[arg-type]
    if not np.isfinite(number):
        return ""
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else repr(number)
