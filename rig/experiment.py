"""What is done to the rig, how it is simulated and how the record is identified."""

from __future__ import annotations

from itertools import pairwise
from math import pi
from typing import ClassVar, Literal

from pydantic import model_validator

from gearbench.rig.value import Value, quantity


class Multisine(Value):
    """Random-phase multisine torque on the driver. `amplitude` is the peak of the whole multisine."""

    groups: ClassVar[tuple[tuple[str, ...], ...]] = (("amplitude", "rms"),)
    forgets: ClassVar[dict[str, tuple[str, ...]]] = {"grid": ("residue",)}
    amplitude: float | None = quantity(None, "nm", gt=0.0, doc="peak of the multisine torque (or give rms)")
    rms: float | None = quantity(None, "nm", gt=0.0, doc="rms of the multisine torque (or give amplitude)")
    band: tuple[float, float] = quantity(unit="hz", doc="lowest and highest excited frequency")
    grid: Literal["full", "odd", "comb", "coset"] = quantity(
        "full",
        doc="excited lines: all, odd, comb: +-residue modulo the hunting period's, coset: +-1 modulo the mesh period's",
    )
    residue: int | None = quantity(
        None, ge=1, le=10**9, doc="comb: lines +-residue modulo lcm(teeth); absent: the one that overlaps least"
    )
    crest: float = quantity(1.7, ge=1.5, doc="crest factor reached by clipping (coset: 1.95 or more)")

    @model_validator(mode="after")
    def _one_size(self) -> Multisine:
        if (self.amplitude is None) == (self.rms is None):
            raise ValueError("give exactly one of amplitude_nm and rms_nm")
        if not 0.0 <= self.band[0] < self.band[1]:
            raise ValueError(f"band_hz = {list(self.band)} must rise from a frequency of at least 0 Hz")
        if self.residue is not None and self.grid != "comb":
            raise ValueError(f'residue = {self.residue} belongs to grid = "comb", but grid = "{self.grid}"')
        return self


class SpeedTable(Value):
    """Speed of the driver over the record, linear from entry to entry and constant before the first and after the
    last."""

    time: tuple[float, ...] = quantity(unit="s", doc="instants of the record, rising from 0 or later")
    driver: tuple[float, ...] = quantity(unit="rpm", doc="driver speed at each")

    @model_validator(mode="after")
    def _rising(self) -> SpeedTable:
        if len(self.time) != len(self.driver) or len(self.time) < 2:
            raise ValueError(
                f"speed_table.time_s has {len(self.time)} entries and speed_table.driver_rpm {len(self.driver)}: both"
                " need the same number, at least 2"
            )
        if self.time[0] < 0 or any(two <= one for one, two in pairwise(self.time)):
            raise ValueError("speed_table.time_s must rise from entry to entry, from 0 s or later")
        if min(self.driver) <= 0:
            least = min(self.driver) * 30 / pi
            raise ValueError(f"speed_table.driver_rpm = {least:g} must be greater than 0 everywhere")
        return self


class Experiment(Value):
    """Speed, torque, excitation and sampling. Exactly one of mesh_frequency, speed_driver and speed_table is given."""

    groups: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("mesh_frequency", "speed_driver", "speed_table"),
        ("speed_end", "speed_table"),
    )
    mesh_frequency: float | None = quantity(None, "hz", gt=0.0, doc="tooth mesh frequency (or give speed_driver)")
    speed_driver: float | None = quantity(None, "rpm", gt=0.0, doc="driver speed (or give mesh_frequency)")
    speed_end: float | None = quantity(
        None, "rpm", gt=0.0, doc="driver speed at the end of a linear run-up or run-down; absent: constant"
    )
    torque_mean: float = quantity(unit="nm", gt=0.0, doc="mean driver torque")
    sampling_rate: float = quantity(unit="hz", gt=0.0, doc="sampling rate of the record")
    samples_per_period: int = quantity(ge=16, le=2**24, doc="samples of one excitation period")
    periods: int = quantity(1, ge=1, le=10_000, doc="recorded excitation periods")
    realisations: int = quantity(1, ge=1, le=100_000, doc="phase realisations")
    seed: int = quantity(0, ge=0, le=2**63 - 1, doc="seed of the random phases")
    settling_tolerance: float = quantity(
        1e-3,
        gt=0.0,
        lt=1.0,
        doc="largest period-to-period change of the DTE, relative to its standard deviation",
    )
    settling_periods_max: int = quantity(
        0,
        ge=0,
        le=10_000,
        doc="excitation periods after which failing to settle is an error; 0: free vibrations are waited for",
    )
    multisine: Multisine | None = quantity(None, doc="absent: constant torque")
    speed_table: SpeedTable | None = quantity(None, doc="absent: constant, or linear to speed_end")

    @model_validator(mode="after")
    def _one_speed(self) -> Experiment:
        given = [one for one in (self.mesh_frequency, self.speed_driver, self.speed_table) if one is not None]
        if len(given) != 1:
            raise ValueError("give exactly one of mesh_frequency_hz and speed_driver_rpm, or a speed_table")
        if self.speed_table is not None and self.speed_end is not None:
            raise ValueError("speed_end_rpm belongs to mesh_frequency_hz or speed_driver_rpm, not to speed_table")
        if self.multisine and self.multisine.band[1] >= self.sampling_rate / 2:
            raise ValueError(
                f"multisine.band_hz ends at {self.multisine.band[1]:g}, which must lie below half of"
                f" sampling_rate_hz = {self.sampling_rate:g}"
            )
        return self

    def mesh_frequency_for(self, teeth_driver: int) -> float:
        """Tooth mesh frequency [Hz] of a driver with that many teeth; where speed changes, that at the beginning."""
        if self.mesh_frequency is not None:
            return self.mesh_frequency
        speed = self.speed_table.driver[0] if self.speed_table is not None else self.speed_driver
        assert speed is not None
        return speed * teeth_driver / (2 * pi)

    @property
    def changes_speed(self) -> bool:
        """Whether the speed changes over the record."""
        return self.speed_table is not None or self.speed_end is not None

    def at_speed(self, speed_driver: float) -> Experiment:
        """The experiment at a constant driver speed [rad/s]."""
        return self._at(speed_driver=speed_driver)

    def at_mesh_frequency(self, mesh_frequency: float) -> Experiment:
        """The experiment at a constant mesh frequency [Hz]."""
        return self._at(mesh_frequency=mesh_frequency)

    def _at(self, **speed: float) -> Experiment:
        none = dict.fromkeys(("mesh_frequency", "speed_driver", "speed_end", "speed_table"))
        return self.model_copy(update={**none, **speed})


class Simulation(Value):
    """How the experiment is simulated."""

    model: Literal["lumped", "reduced", "full"] = quantity(
        "reduced", doc="lumped 3-DOF model, reduced finite elements, or full: all their unknowns"
    )
    substeps: int = quantity(0, ge=0, le=1024, doc="integration steps per sample; 0: as many as the error bound needs")
    mesh_stiffness: Literal["potential-energy", "rectangular", "finite-element"] = quantity(
        "potential-energy", doc="lumped model: law of k(t); finite-element: the non-linear model on FE tables"
    )
    stiffness_single: float | None = quantity(None, "n_per_m", gt=0.0, doc="rectangular k(t): one pair in contact")
    stiffness_double: float | None = quantity(None, "n_per_m", gt=0.0, doc="rectangular k(t): two pairs in contact")
    stiffness_edge: float = quantity(
        0.02, ge=0.0, le=0.5, doc="lumped model: width of the switches of k(t) in mesh periods; 0: sharp"
    )
    element_size: float | None = quantity(
        None, "um", gt=0.0, doc="flank element size; absent: module / 12, of the full model module / 4"
    )
    element: Literal["triangle", "quadrilateral"] = quantity(
        "triangle", doc="elements of the condensed gears; stress is always found on triangles, cracks need them"
    )
    contact: Literal["law", "penalty"] = quantity(
        "law", doc="full model: the contact law's flanks, or the elements' own surfaces by augmented Lagrange"
    )
    outputs: Literal["motion", "teeth"] = quantity(
        "motion", doc="motion, or teeth: the record holds their forces and load shares too (reduced and full model)"
    )
    modes: int = quantity(8, ge=0, le=60, doc="fixed-hub modes kept per gear (reduced model)")
    spectral_radius: float = quantity(
        0.9, ge=0.0, le=1.0, doc="generalised-alpha spectral radius at infinite frequency (reduced and full model)"
    )

    @model_validator(mode="after")
    def _rectangle_complete(self) -> Simulation:
        single, double = self.stiffness_single, self.stiffness_double
        if self.mesh_stiffness == "rectangular" and (single is None or double is None):
            raise ValueError(
                'mesh_stiffness = "rectangular" needs stiffness_single_n_per_m and stiffness_double_n_per_m'
            )
        return self


class Identification(Value):
    """Local polynomial method for periodically time-varying systems."""

    method: Literal["lpm", "mesh-feedback"] = quantity("lpm", doc="estimator")
    harmonics: int = quantity(0, ge=0, le=2000, doc="branches L on each side; 0: as many as the record supports")
    order: int | None = quantity(None, ge=0, le=6, doc="of lpm: polynomial order R; absent: chosen by predicted error")
    window: int = quantity(0, ge=0, le=500, doc="of lpm: half-width n of the window, in lines; 0: chosen")
    band: tuple[float, float] | None = quantity(None, "hz", doc="identified band; absent: the multisine's")

    @model_validator(mode="after")
    def _rising_band(self) -> Identification:
        if self.band and not 0.0 <= self.band[0] < self.band[1]:
            raise ValueError(f"band_hz = {list(self.band)} must rise from a frequency of at least 0 Hz")
        return self


class Condition(Value):
    """A named variation of the experiment: it has a record of its own."""

    name: str = quantity(doc="name of the condition", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=60)
    experiment: Experiment = quantity(doc="the experiment under this condition")
