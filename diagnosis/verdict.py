"""The verdict of a diagnosis (schema "gearbench-verdict/2"): frozen and complete values. What is not known is null,
never a made-up number."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

from gearbench.rig.contract import Place

SCHEMA: Literal["gearbench-verdict/2"] = "gearbench-verdict/2"

Outcome = Literal["effects", "none", "unknown"]
Kind = Literal["channel", "band", "class", "phase", "tooth", "place", "condition"]
KINDS: tuple[str, ...] = get_args(Kind)

# Departure of a sum of probabilities from 1 that rounding in a file explains.
ROUNDING = 1e-6
# Half of an interval that holds nine of ten, in standard deviations.
NINE_OF_TEN = 1.6448536269514722

Name = Annotated[str, Field(min_length=1, max_length=200)]
Probability = Annotated[float, Field(ge=0.0, le=1.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


class Value(BaseModel):
    """Frozen, closed to unknown keys, finite numbers only, no text taken for a number."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, strict=True, populate_by_name=True, hide_input_in_errors=True
    )


class Probabilities(Value):
    """How likely an effect of the library, none, or something unknown is at work; they add up to 1."""

    effect: Probability
    none: Probability
    unknown: Probability

    @model_validator(mode="after")
    def _whole(self) -> Probabilities:
        total = self.effect + self.none + self.unknown
        if abs(total - 1.0) > ROUNDING:
            raise ValueError(f"effect + none + unknown = {total:g} must be 1")
        return self


class Parameter(Value):
    """Estimate of one parameter of an effect, with the interval that holds it with a probability of 90 %, in `unit`."""

    value: float
    low: float
    high: float
    unit: str

    @model_validator(mode="before")
    @classmethod
    def _from_std(cls, data: Any) -> Any:
        """Version 1, and estimates, have a standard deviation in place of the interval."""
        if not isinstance(data, Mapping) or "std" not in data or "low" in data or "high" in data:
            return data
        value, std = data.get("value"), data["std"]
        if isinstance(std, bool) or not isinstance(std, (int, float)) or std < 0:
            raise ValueError(f"std = {std} must be a number that is not negative")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return {key: entry for key, entry in data.items() if key != "std"} | {"low": 0.0, "high": 0.0}
        reach = NINE_OF_TEN * std
        return {"value": value, "low": value - reach, "high": value + reach} | {
            key: entry for key, entry in data.items() if key not in ("value", "std")
        }

    @model_validator(mode="after")
    def _ordered(self) -> Parameter:
        if not self.low <= self.value <= self.high:
            raise ValueError(f"value {self.value:g} must lie between low {self.low:g} and high {self.high:g}")
        return self

    @property
    def std(self) -> float:
        """Standard deviation that the interval stands for."""
        return (self.high - self.low) / (2 * NINE_OF_TEN)


class Range(Value):
    """A value between its lowest and highest likely one; in the file the list [value, low, high]."""

    value: NotNegative
    low: NotNegative
    high: NotNegative

    @model_validator(mode="before")
    @classmethod
    def _from_list(cls, data: Any) -> Any:
        if isinstance(data, (Range, dict)):
            return data
        if not isinstance(data, (list, tuple)) or len(data) != 3:
            raise ValueError("must be a list of three numbers, [value, low, high]")
        return dict(zip(("value", "low", "high"), data, strict=True))

    @model_validator(mode="after")
    def _ordered(self) -> Range:
        if not self.low <= self.value <= self.high:
            raise ValueError(f"value {self.value:g} must lie between low {self.low:g} and high {self.high:g}")
        return self


class Effect(Value):
    """An effect found at work, how likely it is, and its parameters by name.

    `share`: part of the nominal rig's gap that comes back when this effect alone is taken out and all else is fitted
    again (null: not computed), and by channel how much that is, `closes`: rms in um or N m. `due`: whether the gap then
    grows by a tenth or more in some channel, and `grows` the largest factor by which some part of one does (null: not
    computed).
    """

    name: Name
    probability: Probability
    due: bool | None = None
    parameters: dict[Name, Parameter] = {}
    share: Annotated[float, Field(ge=0.0, le=1.0 + ROUNDING)] | None = None
    closes: dict[Name, Range] = {}
    grows: NotNegative | None = None


class Candidate(Value):
    """One hypothesis: its effects (none: the nominal rig with its uncertainties), its log evidence relative to any
    common constant, and its relative gap on the held-out record (null: not computed)."""

    effects: tuple[Name, ...]
    log_evidence: float
    held_out: NotNegative | None = None


class Share(Value):
    """A part of the gap: `share` of the whole of its kind, beside the share that needs no cause.

    `floor_noise` is what measurement noise explains (null: one period, so unknown), `floor_nominal` what the
    uncertainty of the nominal parameters explains (null: not computed), `floor` their sum (null unless both known).
    Floors are parts of the same whole as the shares and may exceed them.
    """

    kind: Kind
    name: Name
    share: Annotated[float, Field(ge=0.0, le=1.0 + ROUNDING)]
    floor: NotNegative | None
    floor_noise: NotNegative | None = None
    floor_nominal: NotNegative | None = None


class Gap(Value):
    """Rms of measured minus simulated in one channel and band of a record, from nominal rig to floor.

    `with_effect` is null when no effect was added, `floor` when the noise is unknown (a single period). Band
    [0, 0] is the mean value.
    """

    record: Name
    channel: Name
    band_hz: tuple[NotNegative, NotNegative]
    unit: str
    nominal: Range
    recalibrated: Range
    with_effect: Range | None
    floor: Range | None

    @model_validator(mode="before")
    @classmethod
    def _band_from_list(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and isinstance(data.get("band_hz"), list):
            return {**data, "band_hz": tuple(data["band_hz"])}
        return data

    @model_validator(mode="after")
    def _rising(self) -> Gap:
        if self.band_hz[0] > self.band_hz[1]:
            raise ValueError(f"band_hz = [{self.band_hz[0]:g}, {self.band_hz[1]:g}] must rise")
        return self


class Part(Value):
    """A part of the gap, explained or left: rms `size` in one channel and band (the missing force of one equation:
    channel "force") in `unit`, um, N m or N, with its 90 % interval; `place` where it arises; `share` of that channel's
    whole nominal gap, by energy; `floors`: multiples of the measurement noise there (null: unknown)."""

    channel: Name
    band_hz: tuple[NotNegative, NotNegative]
    place: Place
    size: NotNegative
    low: NotNegative
    high: NotNegative
    unit: str
    share: NotNegative
    floors: NotNegative | None = None

    @model_validator(mode="before")
    @classmethod
    def _band_from_list(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and isinstance(data.get("band_hz"), list):
            return {**data, "band_hz": tuple(data["band_hz"])}
        return data


class Found(Value):
    """A number of the rig's structure that no nominal case gives, as it was found: housing, shafts, gains."""

    name: Name
    value: float
    low: float
    high: float
    unit: str


class Smallest(Value):
    """A parameter of an effect of the smallest size that records would have named (`value`; null: they would have named
    none), its standard deviation `std` by these records alone, and what a `good` rig has."""

    value: float | None
    std: NotNegative
    good: float
    unit: str


class Detectable(Value):
    """How small an effect the records would have shown, by the parameters that tell its size, the foremost first; `on`:
    the gears or channels that it is about."""

    name: Name
    place: Place
    on: tuple[Name, ...] = ()
    parameters: dict[Name, Smallest]


class Confirmation(Value):
    """How a named effect stands by finite elements: whether it is due there by the same rule, the largest factor by
    which the gap of some part grows without it, nats that the judged record is more likely with it, and its parameters
    as they are fitted there."""

    name: Name
    confirmed: bool
    growth: NotNegative
    gain: float
    parameters: dict[Name, Parameter] = {}


class Confirmed(Value):
    """What the reduced finite-element model says: the gap as in `gap`, the rigs fitted again by it, what it says of
    each named effect, keys of the rig that it leaves out (`lacks`), and why in sentences. No gap: it could not
    answer."""

    model: Literal["reduced"] = "reduced"
    gap: tuple[Gap, ...] = ()
    effects: tuple[Confirmation, ...] = ()
    lacks: tuple[Name, ...] = ()
    because: tuple[str, ...] = ()


class Verdict(Value):
    """What a diagnosis hands back; the fields are those of verdict.json. `signs`: what its probabilities were read
    from, all without dimension: independent "lines", the largest sign of something "unknown" over its limit, parts of
    the gap and of a channel's fluctuation that remain ("left", "remains"; "searched": on the records of the search,
    "hidden": what their noise may hide of it), what changes between repetitions over the gap ("changing"), and how far
    places stand out over what the population's sound rigs leave ("over mesh", ...). `calibrated_on`: rigs behind all
    that. `confirmed`: by finite elements."""

    schema_: Literal["gearbench-verdict/2"] = Field(SCHEMA, alias="schema")
    verdict: Outcome
    probability: Probabilities
    effects: tuple[Effect, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    place: Place
    because: tuple[str, ...] = ()
    explained: tuple[Part, ...] = ()
    remainder: tuple[Part, ...] = ()
    structure: tuple[Found, ...] = ()
    limits: Literal["this rig", "population"] | None = None
    where: tuple[Share, ...] = ()
    gap: tuple[Gap, ...] = ()
    held_out: Name | None = None
    indistinguishable: tuple[tuple[Name, ...], ...] = ()
    detectable: tuple[Detectable, ...] = ()
    advice: tuple[str, ...] = ()
    signs: dict[Name, float] = {}
    calibrated_on: Annotated[int, Field(ge=0)] | None = None
    confirmed: Confirmed | None = None

    @model_validator(mode="after")
    def _agrees_with_itself(self) -> Verdict:
        if self.verdict == "effects" and not self.effects:
            raise ValueError('effects is empty, but verdict "effects" names at least one')
        if self.verdict != "effects" and self.effects:
            raise ValueError(f'effects names {self.effects[0].name}, but verdict "{self.verdict}" names none')
        names = [effect.name for effect in self.effects]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f'effects names "{name}" {names.count(name)} times, must once')
        return self
