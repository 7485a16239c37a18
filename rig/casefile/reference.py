"""The text of cases/reference.toml: every key with its default and one line of what it means."""

from __future__ import annotations

from pydantic.fields import FieldInfo

from gearbench.rig.casefile.case import Case
from gearbench.rig.casefile.reader import table_type
from gearbench.rig.casefile.writer import write_value
from gearbench.rig.gear import Crack, Gear
from gearbench.rig.support import Across, Support
from gearbench.rig.value import SYMBOLS, Value, fields_of, unit_of

_HEAD = """\
# Every key of a case file, with its default and what it means. Written by `gearbench schema --reference`.
#
# The unit is part of the key. A key without default is marked "required"; one that is absent by default
# stands behind a "#" with a value that it could have, and so does a table. The keys of [rig.support.driver] and
# [rig.support.driven] may stand in [rig.support] for both gears. Any number may also be written
# { value = 6e6, sd = 1e6 } (sd: standard deviation). A gear may be a file: driver = "gears/z62.toml" in
# [rig], and a speed table one of the columns time_s and driver_rpm: speed_table = { file = "course.csv" } in
# [experiment]. [[condition]] tables (name + the keys of [experiment] that differ) give one record each.
# [study] is for `gearbench campaign`, whose options stand above it: docs/campaigns.md.
#
# Values without default: gears of ROSS's spur-gear example (62/62 teeth, m 2, b 20, bore radius 17.5);
# experiment and supports of the published finite-element study (2 + 0.4 N m, 8192 Hz, 2 Hz, 6e6 N/m).

"""

# TOML text of keys that have no default, or none that can be written.
_EXAMPLES: dict[str, str] = {
    "name": '"reference"',
    "rig.centre_distance_mm": "124.0",
    "teeth": "62",
    "module_mm": "2.0",
    "tip_diameter_mm": "128.0",
    "face_width_mm": "20.0",
    "hub_radius_mm": "25.0",
    "mass_kg": "1.736",
    "inertia_kg_m2": "3.6025e-3",
    "tip_relief_start_diameter_mm": "126.0",
    "root_relief_start_diameter_mm": "122.0",
    "iso_grade": "6",
    "tooth": "3",
    "length_mm": "0.8",
    "direction_deg": "60.0",
    "stiffness_n_per_m": "6e6",
    "rig.drive.coupling.inertia_kg_m2": "2e-3",
    "rig.drive.coupling.stiffness_nm_per_rad": "5e4",
    "rig.load.coupling.stiffness_nm_per_rad": "5e4",
    "rig.housing.mass_kg": "40.0",
    "rig.housing.stiffness_n_per_m": "1e9",
    "rig.housing.rocking.mass_kg": "20.0",
    "rig.housing.rocking.stiffness_n_per_m": "2e9",
    "rig.sensors.filter_hz": "3500.0",
    "rig.drive.ripple.orders": "[6, 12]",
    "rig.drive.ripple.amplitude_nm": "[0.6, 0.3]",
    "rig.drive.ripple.phase_deg": "[0.0, 90.0]",
    "experiment.mesh_frequency_hz": "2.0",
    "experiment.speed_driver_rpm": "1.935",
    "experiment.speed_end_rpm": "60.0",
    "experiment.speed_table.time_s": "[0.0, 0.6, 1.0]",
    "experiment.speed_table.driver_rpm": "[1.935, 60.0, 60.0]",
    "experiment.torque_mean_nm": "2.0",
    "experiment.sampling_rate_hz": "8192.0",
    "experiment.samples_per_period": "8192",
    "experiment.multisine.amplitude_nm": "0.4",
    "experiment.multisine.rms_nm": "0.2",
    "experiment.multisine.band_hz": "[1.0, 3000.0]",
    "experiment.multisine.residue": "7",
    "simulation.stiffness_single_n_per_m": "2.5e8",
    "simulation.stiffness_double_n_per_m": "4.0e8",
    "simulation.element_size_um": "160.0",
    "study.torque_nm": "100.0",
    "identification.order": "1",
    "identification.band_hz": "[1.0, 3000.0]",
}

# Of keys and tables without default, those that the file sets.
_CHOSEN = {
    "rig.support.driver.stiffness_n_per_m",
    "rig.support.driven.stiffness_n_per_m",
    "experiment.mesh_frequency_hz",
    "experiment.multisine",
    "experiment.multisine.amplitude_nm",
}


def reference_text() -> str:
    """The whole reference case as TOML."""
    return _HEAD + _table(Case, "") + _conditions()


def _table(model: type[Value], path: str, absent: bool = False) -> str:
    """One table and those in it; an `absent` one stands behind "#"."""
    lines, tables = [], []
    for key, (name, info) in fields_of(model).items():
        inner = table_type(info)
        where = f"{path}.{key}" if path else key
        if inner is not None:
            optional = info.default is None and where not in _CHOSEN
            tables.append(_table(inner, where, absent or optional))
            continue
        lines.append(_line(key, where, info, unit_of(model, name), absent, model in (Gear, Crack, Support, Across)))
    hidden = "# " if absent else ""
    header = f"{hidden}[{path}]\n" if path and lines else ""
    own = header + "".join(f"{line}\n" for line in lines) + "\n" if lines else ""
    return own + "".join(tables)


def _line(key: str, where: str, info: FieldInfo, unit: str, hidden: bool, shared: bool) -> str:
    """`key = value  # note`; examples of `shared` tables hold wherever the table stands."""
    example = _EXAMPLES.get(key if shared else where)
    hidden = hidden or (info.default is None and where not in _CHOSEN)
    if info.default is not None and not info.is_required():
        example = write_value(info.default, unit, "", {})
    assert example is not None, f"no example for {where}"
    setting = f"# {key} = {example}" if hidden else f"{key} = {example}"
    notes = [info.description or "", SYMBOLS[unit], "required" if info.is_required() else ""]
    return f"{setting:<42} # {'; '.join(note for note in notes if note)}"


def _conditions() -> str:
    return """\
# [[condition]]
# name = "fast"
# mesh_frequency_hz = 20.0
"""
