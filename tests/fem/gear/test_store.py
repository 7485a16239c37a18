"""Condensed gears and curves on disk: found again, made anew when damaged, never unpickled."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gearbench.fem.contact import curve
from gearbench.fem.contact.store import stored_law
from gearbench.fem.gear import store
from gearbench.fem.gear.store import cached, code_digest, gear_key, key_for, stored_gear
from gearbench.rig import Material


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("GEARBENCH_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def make_counter() -> tuple[list[int], Any]:
    calls: list[int] = []

    def make() -> dict[str, np.ndarray]:
        calls.append(1)
        return {"a": np.arange(5.0), "n": np.asarray(3)}

    return calls, make


def test_made_once_and_found_again(folder: Path) -> None:
    calls, make = make_counter()
    first, second = cached("key", make), cached("key", make)
    assert len(calls) == 1
    np.testing.assert_array_equal(first["a"], second["a"])
    assert [p.name for p in folder.iterdir()] == ["key.npz"]


@pytest.mark.parametrize("damage", [b"", b"not a zip file", "half"])
def test_a_damaged_entry_is_made_again(folder: Path, damage: Any) -> None:
    calls, make = make_counter()
    cached("key", make)
    path = folder / "key.npz"
    path.write_bytes(path.read_bytes()[:200] if damage == "half" else damage)
    np.testing.assert_array_equal(cached("key", make)["a"], np.arange(5.0))
    cached("key", make)
    assert len(calls) == 2


def test_no_damage_of_a_byte_gives_an_error_or_other_numbers(folder: Path) -> None:
    """Every byte of an entry in its turn: the arrays are those that were made, from disk or again."""
    calls, make = make_counter()
    cached("key", make)
    path, hurt = folder / "key.npz", folder / "hurt.npz"
    whole = path.read_bytes()
    made = make()
    for place, byte in enumerate(whole):
        hurt.write_bytes(whole[:place] + bytes([0xFF - byte]) + whole[place + 1 :])
        found = cached("hurt", make)
        assert set(found) == set(made), place
        for name, array in made.items():
            assert found[name].dtype == array.dtype and np.array_equal(found[name], array), place
    assert len(calls) > 0.5 * len(whole)


def test_a_pickled_entry_is_not_loaded(folder: Path) -> None:
    calls, make = make_counter()
    folder.mkdir()
    np.savez(folder / "key.npz", a=np.array([{"evil": 1}], dtype=object))
    np.testing.assert_array_equal(cached("key", make)["a"], np.arange(5.0))
    assert len(calls) == 1


def test_a_cache_that_cannot_be_written_costs_time_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("GEARBENCH_CACHE", str(blocked))
    calls, make = make_counter()
    for _ in range(2):
        np.testing.assert_array_equal(cached("key", make)["a"], np.arange(5.0))
    assert len(calls) == 2


def test_the_key_follows_shape_and_code_but_not_mass(gear: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def key(size: float | None = None, modes: int = 8, material: Material | None = None, **changes: Any) -> str:
        return gear_key(gear(**changes), material or Material(), size, modes)

    plain = key()
    assert key(mass=5.0, inertia=0.1, bore_radius=0.01) == plain
    # A sharp tip edge is rounded before the gear is condensed.
    assert key(tip_edge_radius=0.0) == key(tip_edge_radius=1e-6) != plain
    others = [
        key(profile_shift=0.1),
        key(tip_edge_radius=60e-6),
        key(face_width=0.021),
        key(size=1e-4),
        key(modes=9),
        key(material=Material(poisson=0.31)),
        key(material=Material(state="plane-strain")),
    ]
    assert len({plain, *others}) == 8
    monkeypatch.setattr(store, "code_digest", lambda: "other sources")
    assert key() != plain


def test_the_digest_covers_geometry_fem_and_libraries() -> None:
    assert len(code_digest()) == 64
    assert set(store.SOURCES) == {"gearbench.geometry", "gearbench.fem", "gearbench.kernels"}
    assert key_for("gear", {"a": 1}) != key_for("law", {"a": 1})


def test_a_stored_gear_and_law_are_those_made(
    folder: Path, gear: Any, rig: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(curve, "LOADS", 4)  # they are solved here whatever the cache holds
    wheel = gear(12, profile_shift=0.4, hub_radius=10e-3)
    made = stored_gear(wheel, Material(), 1e-3, 2)
    own = rig(wheel, wheel)
    law = stored_law(own, (made, made), 1e-3, 2)

    def never(*_: Any, **__: Any) -> None:
        raise AssertionError("condensed again")

    monkeypatch.setattr(store, "condense", never)
    found = stored_gear(wheel, Material(), 1e-3, 2)
    for name, value in vars(made).items():
        np.testing.assert_array_equal(getattr(found, name), value)
        assert type(getattr(found, name)) is type(value)
    again = stored_law(own, (found, found), 1e-3, 2)
    for one, two in zip(law.curves.driver, again.curves.driver, strict=True):
        np.testing.assert_array_equal(one, two)
        assert type(one) is type(two)
    assert again.reach2 == law.reach2
