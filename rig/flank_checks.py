"""Checks of a gear's micro-geometry and errors: tables of equal length, one value a tooth, what needs what."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from gearbench.rig.checks import items_within
from gearbench.rig.value import format_number, key_of, unit_of

if TYPE_CHECKING:
    from gearbench.rig.gear import Gear

_LARGEST = 1e-3  # m
_FACTOR = 100.0

# Lists with one value for each tooth.
_PER_TOOTH = ("pitch_error", "profile_slope_tooth", "profile_form_tooth", "wear_tooth")
# What iso_grade draws, so that it cannot stand beside it.
DRAWN = ("profile_slope_tooth", "profile_form", "pitch_error", "runout")


def check_flank(gear: Gear) -> None:
    """Raise ValueError, one sentence, at the first contradiction."""
    for name in _PER_TOOTH:
        given = len(getattr(gear, name))
        if given not in (0, gear.teeth):
            raise ValueError(
                f"{_key(gear, name)} has {given} values, must have none or {gear.teeth}, one for each of the teeth"
            )
    for name in ("tip_relief", "root_relief"):
        if getattr(gear, name) and getattr(gear, f"{name}_start_diameter") is None:
            usual = ""
            if name == "tip_relief":
                usual = "; long relief starts at the outer point of single contact, which `check` prints"
            raise ValueError(f"{_key(gear, f'{name}_start_diameter')} is missing: {_key(gear, name)} is given{usual}")
    if gear.profile_form_diameter and gear.profile_form_roll:
        raise ValueError("profile_form_diameter_mm and profile_form_roll_deg are both given: one of them")
    axis = "profile_form_diameter" if gear.profile_form_diameter else "profile_form_roll"
    _table(gear, "profile_form", axis)
    _table(gear, "wear_depth", "wear_roll")
    for name in ("profile_slope_tooth", "profile_form"):
        items_within(gear, name, -_LARGEST, _LARGEST)
    items_within(gear, "wear_depth", 0.0, _LARGEST)
    for name in ("profile_form_tooth", "wear_tooth"):
        items_within(gear, name, -_FACTOR if name == "profile_form_tooth" else 0.0, _FACTOR)
    if gear.iso_grade is not None:
        for name in DRAWN:
            held = getattr(gear, name)
            if any(held) if isinstance(held, tuple) else held:
                raise ValueError(
                    f"iso_grade = {gear.iso_grade} draws {_key(gear, name)}, which is given as well: one of them"
                )


def _key(gear: Gear, name: str) -> str:
    return key_of(type(gear), name)


def _table(gear: Gear, values: str, axis: str) -> None:
    """A table of `values` over a rising `axis`, or neither."""
    height, places = getattr(gear, values), getattr(gear, axis)
    if len(height) != len(places):
        raise ValueError(
            f"{_key(gear, values)} has {len(height)} and {_key(gear, axis)} has {len(places)} values: they must have"
            " equally many"
        )
    if len(height) == 1:
        raise ValueError(f"{_key(gear, values)} has 1 value: a table needs none or at least 2")
    unit = unit_of(type(gear), axis)
    for position, (before, after) in enumerate(pairwise(places), start=1):
        if not after > before:
            raise ValueError(
                f"{_key(gear, axis)}[{position}] = {float(format_number(after, unit)):g} must be greater than the one"
                f" before it, {float(format_number(before, unit)):g}"
            )
    if places and places[0] <= 0:
        raise ValueError(f"{_key(gear, axis)}[0] = {float(format_number(places[0], unit)):g} must be greater than 0")
