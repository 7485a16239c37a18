"""A case: one rig, one experiment, how both are simulated and identified; from and to TOML."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError, model_validator

from gearbench.rig.casefile.defaults import Completed, complete
from gearbench.rig.casefile.reader import Reader, show, table_type
from gearbench.rig.casefile.speed_file import include_speeds
from gearbench.rig.casefile.toml import Table, apply_settings, include_gear, load_table
from gearbench.rig.casefile.writer import write_conditions, write_tables
from gearbench.rig.errors import CaseError
from gearbench.rig.experiment import Condition, Experiment, Identification, Simulation
from gearbench.rig.rig import Rig
from gearbench.rig.study import Study
from gearbench.rig.value import Value, derived, fields_of, key_of, quantity

__all__ = ["Case", "CaseError", "dump_case", "read_case"]

_CONDITION_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,59}")


class Case(Value):
    """A rig, an experiment on it, and how both are simulated and identified.

    `conditions` are complete experiments, one record each; without any, `experiment` is the only one. A case may lack
    an experiment (`stated` is then False, and its `experiment` a placeholder): it serves `static`, `mesh` and `check`.
    `assumed` says what the file leaves out and was taken instead.
    `uncertainty` maps a dotted field path ("rig.support.driver.stiffness") to a standard deviation in SI.
    """

    name: str = quantity(doc="name of the case", min_length=1)
    rig: Rig = quantity(doc="the rig")
    experiment: Experiment = quantity(doc="what is done to the rig")
    simulation: Simulation = quantity(Simulation(), doc="how the experiment is simulated")
    identification: Identification = quantity(Identification(), doc="how the record is identified")
    study: Study | None = quantity(None, doc="what `campaign` varies; absent: what its options say")
    conditions: tuple[Condition, ...] = derived((), doc="[[condition]]: named variations of the experiment")
    uncertainty: dict[str, float] = derived({}, doc="standard deviations in SI by dotted field path")
    stated: bool = derived(True, doc="whether an experiment is given")
    assumed: tuple[str, ...] = derived((), doc="sentences on values that the file leaves out")

    @model_validator(mode="after")
    def _fits_together(self) -> Case:
        band, half = self.identification.band, self.experiment.sampling_rate / 2
        if band and band[1] >= half:
            raise ValueError(
                f"identification.band_hz ends at {band[1]:g}, which must lie below half of"
                f" experiment.sampling_rate_hz, {half:g} Hz"
            )
        for where, experiment in (
            ("experiment", self.experiment),
            *((f'experiment of condition "{one.name}"', one.experiment) for one in self.conditions),
        ):
            if experiment.multisine is not None and self.rig.drive.boundary != "torque":
                raise ValueError(
                    f"the {where} has a multisine, which needs a driver torque to be imposed, but rig.drive.boundary ="
                    f' "{self.rig.drive.boundary}": leave the multisine out, or set "torque"'
                )
        names = [condition.name for condition in self.conditions]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f'condition name "{name}" is given {names.count(name)} times, must be given once')
        return self

    def under(self, condition: Condition) -> Case:
        """The case whose experiment is that of one condition."""
        return self.model_copy(update={"experiment": condition.experiment, "conditions": (), "stated": True})

    def experiments(self) -> list[tuple[str, Case]]:
        """The case under each of its conditions and that one's name; without any, the case itself under no name."""
        return [(condition.name, self.under(condition)) for condition in self.conditions] or [("", self)]


def read_case(path: str | Path, overrides: Sequence[str] = ()) -> Case:
    """Read a case file; `overrides` are `dotted.key=value` settings that replace keys before validation.

    Gears and speed tables given as files are looked up relative to the case file. Raises CaseError (one sentence).
    """
    path = Path(path)
    document = load_table(path, "case file")
    apply_settings(document, overrides, path.parent)
    for side in ("driver", "driven"):
        include_gear(document, side, path.parent)
    include_speeds(document, path.parent)
    return _case_of(document, complete(document, path))


def _case_of(document: Table, completed: Completed) -> Case:
    reader = Reader(Case)
    conditions = document.pop("condition", [])
    fields = reader.table(Case, document, "", "")
    fields["conditions"] = _read_conditions(conditions, document["experiment"], reader)
    fields["uncertainty"] = reader.uncertainty
    fields |= completed._asdict()
    try:
        return Case.model_validate(fields)
    except ValidationError as error:
        raise CaseError(one_sentence(error)) from error


def _read_conditions(tables: Any, base: Mapping[str, Any], reader: Reader) -> list[dict[str, Any]]:
    if not isinstance(tables, list):
        raise CaseError("condition must be a list of tables: write [[condition]]")
    conditions = []
    for number, table in enumerate(tables):
        where = f"condition[{number}]"
        if not isinstance(table, Mapping):
            raise CaseError(f"{where} = {show(table)} must be a table")
        changes = dict(table)
        name = changes.pop("name", None)
        if not isinstance(name, str) or not _CONDITION_NAME.fullmatch(name):
            raise CaseError(
                f"{where}.name = {show(name) if name is not None else 'nothing'} must be at most 60"
                " letters, digits, dots, dashes and underscores (it names a file)"
            )
        merged = _merge(Experiment, base, changes)
        path = f"conditions.{number}.experiment"
        conditions.append({"name": name, "experiment": reader.table(Experiment, merged, where, path)})
    return conditions


def _merge(model: type[Value], base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with `changes` on top, sub-tables merged; of a group of alternatives the changed one stays."""
    kept = dict(base)
    for group in model.groups:
        keys = [key_of(model, name) for name in group]
        if any(key in changes for key in keys):
            for key in keys:
                kept.pop(key, None)
    for name, others in model.forgets.items():
        if key_of(model, name) in changes:
            for other in others:
                kept.pop(key_of(model, other), None)
    for key, value in changes.items():
        below = _table_of(model, key)
        inner = kept.get(key)
        if below is not None and isinstance(inner, Mapping) and isinstance(value, Mapping):
            kept[key] = _merge(below, inner, value)
        else:
            kept[key] = value
    return kept


def _table_of(model: type[Value], key: str) -> type[Value] | None:
    known = fields_of(model)
    return table_type(known[key][1]) if key in known else None


def one_sentence(error: ValidationError) -> str:
    """One sentence from what pydantic found: the first error, with its dotted key."""
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    words = str(first["msg"]).removeprefix("Value error, ")
    return f"{where}: {words}" if where else words


def dump_case(case: Case) -> str:
    """The case as TOML text with every key; `read_case` of it gives an equal case.

    >>> import gearbench as gb
    >>> print(gb.dump_case(gb.read_case("quick_lumped")).splitlines()[0])
    name = "quick_lumped"
    """
    tables = write_tables(Case, case, "", case.uncertainty, () if case.stated else ("experiment",))
    return tables + write_conditions(case.conditions, case.uncertainty)
