"""Which records a fit can follow: those whose flanks stay together on the nominal rig, or on another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from gearbench.diagnosis.selection.followable import LOSING, LOSING_MORE, followable, lost_contact, smooth_records


def answer(case: Any, record: int | None) -> xr.Dataset:
    """A replay of 1000 samples, in so many of which flanks are apart; none for None."""
    if record is None:
        raise ValueError("it does not settle")
    return xr.Dataset(coords={"time": np.arange(1000.0)}, attrs={"contact_lost_samples": record})


@pytest.mark.parametrize(
    ("lost", "smooth"),
    [([0, 300, 5], [0, 2]), ([300, 40, 200], [1]), ([300, 400], []), ([0, None], []), ([], [])],
)
def test_records_whose_flanks_stay_together_are_followed_or_those_that_part_least(
    lost: list[int | None], smooth: list[int]
) -> None:
    records: Any = [SimpleNamespace(phase_known=True, record=one) for one in lost]
    nominal: Any = None
    assert smooth_records([nominal], records, answer) == smooth  # type: ignore[arg-type]
    parts = lost_contact(nominal, records, answer)  # type: ignore[arg-type]
    assert parts == ([] if None in lost else [one / 1000 for one in lost if one is not None])
    limit = LOSING if any(part < LOSING for part in parts) else LOSING_MORE
    assert all(parts[number] < limit for number in smooth)


@pytest.mark.parametrize(
    ("nominal", "other", "smooth"),
    [
        ([300, 400], [60, 400], [0]),
        ([300, 5], [0, 0], [1]),
        ([300, 400], [300, 400], []),
        ([300, None], [0, 5], [0, 1]),
    ],
)
def test_another_rig_is_asked_where_flanks_part_in_all_records_of_the_first(
    nominal: list[int | None], other: list[int | None], smooth: list[int]
) -> None:
    records: Any = [SimpleNamespace(phase_known=True, record=number) for number in range(2)]

    def of_rig(rig: Any, record: Any) -> xr.Dataset:
        return answer(rig, rig[record])

    rigs: Any = [nominal, other]
    assert smooth_records(rigs, records, of_rig) == smooth


def test_back_flanks_that_touch_are_no_contact_of_the_working_ones() -> None:
    """A pair without backlash never lets go, but its flanks part as those of any other."""

    def without_backlash(rig: Any, record: Any) -> xr.Dataset:
        return answer(rig, 0).assign_attrs(unloaded_samples=record)

    records: Any = [SimpleNamespace(phase_known=True, record=one) for one in (0, 200)]
    assert lost_contact(None, records, without_backlash) == [0.0, 0.2]  # type: ignore[arg-type]
    assert smooth_records([None], records, without_backlash) == [0]  # type: ignore[list-item]


def test_records_without_a_mesh_phase_are_not_simulated() -> None:
    records: Any = [SimpleNamespace(phase_known=False, record=None)]
    assert lost_contact(None, records, answer) == []  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("lost", "channels", "followed", "nudged"),
    [
        ([0, 300, 5], ["angle_driver"], [0, 2], []),
        ([300, 40, 200], ["angle_driver"], [0, 1, 2], ["0", "1", "2"]),
        ([300, 40, 200], [], [1], []),
        ([300, None], ["angle_driver"], [], []),
    ],
)
def test_records_are_nudged_where_flanks_part_in_all(
    lost: list[int | None], channels: list[str], followed: list[int], nudged: list[str]
) -> None:
    records: Any = [
        SimpleNamespace(name=str(number), phase_known=True, record=one) for number, one in enumerate(lost)
    ]
    spectra = dict.fromkeys(channels)
    conditions = [SimpleNamespace(name=one.name, stiffness_level=4e8, spectra=spectra) for one in records]
    model = SimpleNamespace(inertia=(4e-3, 1e-2), rotor=2e-3, base_radius=(0.1, 0.2))
    problem: Any = SimpleNamespace(model=model, conditions=conditions)
    found, nudges, restless = followable([None], records, problem, answer)  # type: ignore[list-item]
    assert found == followed
    assert restless == {one for one in nudges if (lost[int(one)] or 0) >= 1000 * LOSING_MORE}
    assert sorted(nudges) == nudged
    assert all(value == pytest.approx(np.sqrt(4e8 * 6e-3 / 0.1**2)) for value in nudges.values())


def test_records_are_not_nudged_that_the_rig_of_the_forces_holds_together() -> None:
    """A nominal rig that resonates where the records' does not parts flanks that stay together."""
    records: Any = [SimpleNamespace(name=str(number), phase_known=True, record=number) for number in range(2)]

    def of_rig(rig: Any, record: Any) -> xr.Dataset:
        return answer(rig, rig[record])

    rigs: Any = [[12, 209], [2, 193]]
    problem: Any = None
    assert followable(rigs, records, problem, of_rig) == ([0], {}, frozenset())
