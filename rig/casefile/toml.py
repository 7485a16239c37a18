"""From a TOML file to a plain table with exact decimals, and settings from the command line on top of it."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from decimal import Decimal, DecimalException
from pathlib import Path
from typing import Any

from gearbench.rig.errors import CaseError

Table = dict[str, Any]

_LARGEST_FILE = 4_000_000  # bytes; the largest sensible case (pitch errors of a thousand teeth) has 30 kB


def load_table(path: Path, what: str) -> Table:
    """Parse one TOML file (`what` names its role in the error). Raises CaseError."""
    raw = read_bytes(path, what, "TOML")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CaseError(f"{what} {path} is not UTF-8 text (byte {error.start})") from error
    try:
        return tomllib.loads(text, parse_float=Decimal)
    except (ValueError, DecimalException) as error:
        reason = str(error) if isinstance(error, ValueError) else "a number is out of every range"
        raise CaseError(f"{what} {path} is not valid TOML: {reason}") from error
    except RecursionError as error:
        raise CaseError(f"{what} {path} is nested too deeply") from error


def read_bytes(path: Path, what: str, kind: str) -> bytes:
    """The bytes of a text file of a kind ("TOML") that a case needs. Raises CaseError for what is none."""
    if not path.exists():
        raise CaseError(f"{what} {path} does not exist")
    if path.is_dir():
        raise CaseError(f"{what} {path} is a folder, not a {kind} file")
    if not path.is_file():  # a device or a pipe may never end
        raise CaseError(f"{what} {path} is not a plain file, which a {kind} file is")
    try:
        with path.open("rb") as file:
            raw = file.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise CaseError(f"{what} {path} cannot be read: {error.strerror or error}") from error
    if len(raw) > _LARGEST_FILE:
        raise CaseError(f"{what} {path} is larger than {_LARGEST_FILE // 1_000_000} MB, which no case needs")
    return raw


def parse_setting(setting: str) -> tuple[list[str], Any]:
    """Split `dotted.key=value`; the value is read as TOML and, where it is not TOML, as a plain string."""
    dotted, equals, text = setting.partition("=")
    keys = [key.strip() for key in dotted.split(".")]
    if not equals or not all(keys):
        raise CaseError(f"setting {setting!r} must read dotted.key=value")
    return keys, _parse_value(text.strip())


def _parse_value(text: str) -> Any:
    try:
        document = tomllib.loads(f"value = {text}", parse_float=Decimal)
    except (ValueError, DecimalException, RecursionError):
        return text
    return document["value"] if set(document) == {"value"} else text


def include_gear(document: Table, side: str, folder: Path) -> None:
    """Replace `rig.<side> = "file"` in `document` by the table in that file, relative to `folder`."""
    rig = document.get("rig")
    name = rig.get(side) if isinstance(rig, dict) else None
    if isinstance(rig, dict) and isinstance(name, str):
        if not name:
            raise CaseError(f'rig.{side} = "" must name a gear file')
        rig[side] = load_table(folder / name, f"gear file rig.{side} =")


def apply_settings(document: Table, settings: Sequence[str], folder: Path) -> None:
    """Apply `dotted.key=value` settings in order, in place; a gear file is read when a key enters it.

    A gear file that a setting names may lie in the case file's folder or in the present one.
    """
    for setting in settings:
        keys, value = parse_setting(setting)
        if keys[0] == "rig" and len(keys) > 2 and keys[1] in ("driver", "driven"):
            include_gear(document, keys[1], folder)
        table: Any = document
        for depth, key in enumerate(keys[:-1]):
            table = _enter(table, key, ".".join(keys[: depth + 1]), setting)
        if keys[0] == "rig" and len(keys) == 2 and keys[1] in ("driver", "driven") and isinstance(value, str):
            value = _from_the_callers_folder(value, folder)
        if keys[-2:] == ["speed_table", "file"] and isinstance(value, str):
            value = _from_the_callers_folder(value, folder)
        if isinstance(table, list):
            table[_position(table, keys[-1], ".".join(keys), setting)] = value
        else:
            table[keys[-1]] = value
        if keys[:2] == ["rig", "support"] and len(keys) == 3:
            # The common value was set last, so it wins over what the file says for one gear.
            for side in ("driver", "driven"):
                own = table.get(side)
                if isinstance(own, dict):
                    own.pop(keys[2], None)


def _from_the_callers_folder(name: str, folder: Path) -> str:
    """A file that a setting names: beside the case file or, where there is none, as the caller would find it."""
    return str(Path(name).resolve()) if name and not (folder / name).exists() and Path(name).exists() else name


def _enter(table: Any, key: str, where: str, setting: str) -> Any:
    if isinstance(table, list):
        inner = table[_position(table, key, where, setting)]
    else:
        inner = table.setdefault(key, {})
    if not isinstance(inner, dict | list):
        raise CaseError(f"setting {setting!r} reaches into {where}, which is a value and not a table")
    return inner


def _position(table: list[Any], key: str, where: str, setting: str) -> int:
    if not key.isdecimal() or int(key) >= len(table):
        raise CaseError(f"setting {setting!r}: {where} must be a position in a list of {len(table)}, from 0 on")
    return int(key)
