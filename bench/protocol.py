"""What a model is to the bench: it refuses what it cannot represent, prepares a rig, and takes it from state to state.

Everything else of an experiment is written once: periods, settling, realisations, sensors and the record's attributes
(`bench.experiment`). A new model costs one file that satisfies `Model` and one line in `bench.models`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.plan.excitation import Torque
from gearbench.bench.plan.schedule import ProgressReport, Schedule
from gearbench.bench.plan.settling import Keep
from gearbench.bench.record.static import Loads
from gearbench.rig import Case

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
State = TypeVar("State")

# What is being done, now and then.
Note = Callable[[str], None]


class Drive(NamedTuple):
    """One excitation period of the torque, or one sample of a constant one: `torque` (samples,) [N m] as recorded, and
    `fine` on the model's own grid and in its own unit; both repeat."""

    torque: Array
    fine: Array


class Channels(NamedTuple):
    """Channels (n,) of a record over n samples, in SI units, before any sensor. Angles are what is left of them when
    both gears turn steadily, unless the model says that they are `absolute`. x is None where no centre moves across its
    support, torque_driver where it is the commanded one; tooth_force [N]: of working flanks by the names of
    `record.channels.PAIRS`, and of back flanks, where they are asked for."""

    torque_driven: Array
    angle_driver: Array
    angle_driven: Array
    y_driver: Array
    y_driven: Array
    dte: Array
    force: Array
    x_driver: Array | None = None
    x_driven: Array | None = None
    torque_driver: Array | None = None
    tooth_force: Mapping[str, Array] | None = None


class Prepared(Protocol[State]):
    """A case made ready: all that its realisations share. Immutable; states are values.

    keep: what of the steady state becomes the record; piece: samples between two looks at an interruption (0: a whole
    block); absolute: angles contain the steady rotation; substeps: integration steps per sample; settings: what the
    provenance says of the solution; attributes: of the record, beyond those that all have; warnings: sentences.
    """

    @property
    def keep(self) -> Keep: ...
    @property
    def piece(self) -> int: ...
    @property
    def absolute(self) -> bool: ...
    @property
    def substeps(self) -> int: ...
    @property
    def settings(self) -> Mapping[str, Any]: ...
    @property
    def attributes(self) -> Mapping[str, Any]: ...
    @property
    def warnings(self) -> tuple[str, ...]: ...
    @property
    def decay(self) -> float | None:
        """Slowest rate [1/s] at which free vibrations die out, where records that do not repeat wait for it."""

    @property
    def slowest(self) -> float | None:
        """That rate, where the model knows it."""

    def drive(self, torque: Torque) -> Drive:
        """One period of a torque on the model's grid."""

    def start(self, sample: int) -> State:
        """Static equilibrium under the mean torque at a sample of the record (negative: before it)."""

    def advance(self, drive: Drive, state: State, samples: int) -> tuple[State, Array]:
        """The state `samples` samples later and the outputs (samples, n) on the way, from the state's own instant on.
        Raises one sentence where the integration fails."""

    def dte(self, outputs: Array) -> Array:
        """DTE (samples,) [m] of outputs."""

    def channels(self, outputs: Array, torque: Array) -> Channels:
        """Channels of outputs (samples, n) under recorded torques (samples,) [N m]."""

    def apart(self, outputs: Array) -> NDArray[np.bool_] | None:
        """Samples (samples,) in which no teeth touch; None for a model that does not let go."""

    def strayed(self, outputs: Array) -> NDArray[np.bool_] | None:
        """Samples (samples,) in which teeth overlap beyond the modelled flanks or press harder than modelled: what the
        model says there and afterwards is not the rig's; None for a model without such limits."""

    def divided(self, outputs: Array) -> int | None:
        """Steps that had to be divided to be solved; None for a model that never does that."""


class Model(Protocol):
    """A solver. `name`: simulation.model; `title`: what sentences call it; `elastic`: gears are meshed and condensed,
    so that each tooth is its own and stresses can be asked for."""

    name: str
    title: str
    elastic: bool

    def refuse(self, case: Case) -> None:
        """Raise BenchError or GeometryError for what the model does not represent or cannot mesh, in one sentence,
        before anything is meshed or solved."""

    def prepare(self, case: Case, plan: Schedule, note: Note) -> Prepared[Any]:
        """The case made ready. Raises what meshing and solving raise."""

    def static(self, case: Case, loads: Loads, phase: Array, report: ProgressReport) -> xr.Dataset:
        """Static response at mesh phases (n,) [cycles], as `record.static.static_dataset` makes it."""
