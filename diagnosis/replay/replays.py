"""Replays of records that share one law of sound teeth: it is loaded once, and backlash and flanks follow the rig."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from gearbench.diagnosis.forces.nominal import table_load
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.geometry import pair
from gearbench.lumped.nonlinear.law import MeshLaw
from gearbench.rig import Case

Array = NDArray[np.float64]

# Steps of a search are so much longer than those of a simulation: the fastest mode's frequency is then right to 2e-3,
# and lines to 5e-4 where the finer steps leave 1e-4; any model of a record is wrong by more.
COARSER = 2**0.5
LAWS = 8  # of different backlash or flanks whose secants are kept: most replays have the nominal ones


class Replay(Protocol):
    """One steady repetition of a case's rig under a record's torque, its driver nudged [N s/m] towards the motion that
    the record has, if told to."""

    def __call__(self, case: Case, record: xr.Dataset, /, nudge: float = 0.0) -> xr.Dataset: ...


def law_of(sound: MeshLaw, case: Case) -> MeshLaw:
    """The law of sound teeth with the backlash and the flanks of the case's rig."""
    # Solving it compiles loops on import, which not every user of this module wants.
    from gearbench.bench.nonlinear.law_table import flank_excess, own_compliance

    meshing, mesh = pair(case.rig), case.rig.mesh
    law = _with_backlash(sound, max(meshing.backlash_normal, 0.0))
    excess, own = flank_excess(sound, case.rig, case.simulation), own_compliance(sound, meshing, mesh)
    return _with_flanks(law, _key(excess), mesh.shared_compliance, _key(own))


def _key(table: Array | None) -> bytes | None:
    return None if table is None else table.tobytes()


@lru_cache(maxsize=LAWS)
def _with_flanks(law: MeshLaw, excess: bytes | None, more: float, own: bytes | None) -> MeshLaw:
    from gearbench.lumped.nonlinear.forms import formed

    return formed(law, _table(law, excess), more, _table(law, own))


def _table(law: MeshLaw, key: bytes | None) -> Array | None:
    return None if key is None else np.frombuffer(key).reshape(law.share.shape)


@lru_cache(maxsize=LAWS)
def _with_backlash(law: MeshLaw, backlash: float) -> MeshLaw:
    return replace(law, backlash=backlash)


@dataclass(frozen=True, eq=False)
class Replays:
    """Replays on the non-linear lumped model with the law of `sound` teeth: rigs may differ in everything but the teeth
    that it was made for. Steps are `coarser` than those of a simulation by that factor."""

    sound: MeshLaw
    coarser: float = 1.0

    def __call__(self, case: Case, record: xr.Dataset, /, nudge: float = 0.0) -> xr.Dataset:
        # Its time loop is compiled on import, which not every user of this module wants.
        from gearbench.bench.nonlinear.replay import replay

        return replay(case, record, law_of(self.sound, case), nudge=nudge, coarser=self.coarser)


def replays_of(nominal: Case, measurements: Sequence[Measurement]) -> Replay:
    """The replays of these measurements on the nominal rig's law."""
    from gearbench.bench.nonlinear.law_table import teeth_law

    return Replays(teeth_law(nominal.rig, nominal.simulation, table_load(nominal.rig, measurements)))
