"""Which keys of a case damp its free vibrations: what an error about vibrations that do not die out advises."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from gearbench.rig import Case


class Damper(NamedTuple):
    """A key of the case and its value in the key's unit."""

    key: str
    value: float

    def __str__(self) -> str:
        return f"{self.key} = {self.value:g}"


def dampers(case: Case) -> list[Damper]:
    """Dampers that stand beside the springs of a rig, those of gears or mesh last."""
    return [*_around(case), _of_gears(case)]


def _around(case: Case) -> Iterator[Damper]:
    rig = case.rig
    for name, support in (("driver", rig.support.driver), ("driven", rig.support.driven)):
        if support.stiffness is not None:
            yield Damper(f"rig.support.{name}.damping_n_s_per_m", support.damping)
        if support.across is not None:
            yield Damper(f"rig.support.{name}.across.damping_n_s_per_m", support.across.damping)
    if rig.housing is not None:
        yield Damper("rig.housing.damping_n_s_per_m", rig.housing.damping)
    for name, shaft in (("drive", rig.drive.coupling), ("load", rig.load.coupling)):
        if shaft is not None and shaft.stiffness is not None:
            yield Damper(f"rig.{name}.coupling.damping_nm_s_per_rad", shaft.damping)


def _of_gears(case: Case) -> Damper:
    if case.simulation.model == "lumped":
        return Damper("rig.damping.mesh_ratio", case.rig.damping.mesh_ratio)
    return Damper("rig.damping.material_ratio", case.rig.damping.material_ratio)


def damping_advice(case: Case) -> str:
    """The damping to raise, by its keys and their values: those that are 0 where there are any, else all."""
    return undamped(case) or ", ".join(map(str, dampers(case)))


def undamped(case: Case) -> str:
    """The keys of the dampers that are 0; empty where there are none."""
    return ", ".join(str(damper) for damper in dampers(case) if damper.value == 0.0)
