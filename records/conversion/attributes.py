"""Attributes of the record: from the map, from a case, from the file, in this order."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Source

Attributes = dict[str, float | str]

# Facts of a file under names that others give them.
_ALIASES = {
    "fs": "sampling_rate",
    "samplerate": "sampling_rate",
    "sample_rate": "sampling_rate",
    "samplingrate": "sampling_rate",
    "sampling_frequency": "sampling_rate",
    "abtastrate": "sampling_rate",
    "abtastfrequenz": "sampling_rate",
}
# Attributes of a record (SI) that a file may hold under their own names.
_NUMBERS = (
    "sampling_rate",
    "samples_per_period",
    "periods",
    "mesh_period",
    "teeth_driver",
    "teeth_driven",
    "base_radius_driver",
    "base_radius_driven",
    "inertia_driver",
    "inertia_driven",
    "working_pressure_angle",
    "torque_mean",
)
_WORDS = ("support_direction", "driven_boundary", "mesh_phase_origin", "condition")
_WHOLE = ("samples_per_period", "periods", "teeth_driver", "teeth_driven")
_SPEEDS = ("mesh_period", "mesh_frequency", "speed_driver")
_LENGTHS = ("samples_per_period", "excitation_period")


def facts_of(source: Source) -> Attributes:
    """Facts of a file that are attributes of a record, in its own names and SI units."""
    found: Attributes = {}
    for key, value in source.facts.items():
        word = key.rpartition(".")[2]
        name = _ALIASES.get(word.lower(), word)
        if (name in _NUMBERS and isinstance(value, float)) or (name in _WORDS and isinstance(value, str)):
            found.setdefault(name, value)
    return found


def merged(*layers: Mapping[str, float | str]) -> Attributes:
    """Attributes of several origins, the first one's first; what says the same (speed, period) hides the others'."""
    out: Attributes = {}
    for layer in layers:
        hidden = {name for group in (_SPEEDS, _LENGTHS) if any(name in out for name in group) for name in group}
        out |= {name: value for name, value in layer.items() if name not in out and name not in hidden}
    return out


def declared_mesh_period(attributes: Mapping[str, float | str]) -> float | None:
    """Mesh period [s] from whichever attribute tells it."""
    if "mesh_period" in attributes:
        return float(attributes["mesh_period"])
    if "mesh_frequency" in attributes:
        return 1.0 / float(attributes["mesh_frequency"])
    if "speed_driver" in attributes:
        if "teeth_driver" not in attributes:
            raise RecordError("record.speed_driver_rpm needs teeth_driver: the mesh frequency follows from both")
        return 2 * pi / (float(attributes["speed_driver"]) * float(attributes["teeth_driver"]))
    return None


def missing_attributes(attributes: Mapping[str, float | str], channels: Mapping[str, object]) -> list[str]:
    """Keys of [record] without which the record would not serve `identify`."""
    missing = [] if any(name in attributes for name in _LENGTHS) else ["samples_per_period (or excitation_period_s)"]
    if "dte" in channels and "force" in channels:
        if declared_mesh_period(attributes) is None and "mesh_phase" not in channels:
            missing.append("mesh_frequency_hz")
        return missing
    wanted = {
        "teeth_driver": "teeth_driver",
        "teeth_driven": "teeth_driven",
        "base_radius_driver": "base_radius_driver_mm",
        "base_radius_driven": "base_radius_driven_mm",
        "driven_boundary": "driven_boundary",
    }
    if attributes.get("driven_boundary") == "torque":
        wanted |= {"inertia_driver": "inertia_driver_kg_m2", "inertia_driven": "inertia_driven_kg_m2"}
    if any(name in channels for name in ("y_driver", "y_driven")):
        wanted |= {"support_direction": "support_direction"}
        if attributes.get("support_direction", "tangential") == "tangential":
            wanted |= {"working_pressure_angle": "working_pressure_angle_deg"}
    return missing + [key for name, key in wanted.items() if name not in attributes]


def record_attributes(attributes: Mapping[str, float | str]) -> dict[str, float | int | str]:
    """Those attributes that a record carries, with whole numbers as such."""
    carried = (*_NUMBERS, *_WORDS)
    return {
        name: int(value) if name in _WHOLE else value
        for name, value in attributes.items()
        if name in carried and name not in ("sampling_rate", "samples_per_period", "periods", "mesh_period")
    }
