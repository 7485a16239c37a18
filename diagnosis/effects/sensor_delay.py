"""A sensor whose channel lags behind, or leads, the others."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.effects.effect import Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.equations import DELAYED
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, group
from gearbench.rig import Rig

# Groups by channel.
KEYS = {channel: f"delay-{channel}" for channel in DELAYED}
# In periods of the mesh's resonance: a tenth (half a sample at five samples a period) is severity 1 of the truth rigs;
# sound channels share a clock to a tenth of it.
SD, WIDE = 0.0075, 0.11
# Over the former: phases turn by many radians at the end of the band, and the search begins on either side.
STARTS = (-15.0, -7.5, 7.5, 15.0)


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """The lag of every channel."""
    sound, large = SD / model.resonance, WIDE / model.resonance
    return tuple(
        group(key, "s", ("delay",), sound, large, slot="delay", first=number)
        for number, key in enumerate(KEYS.values())
    )


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """One channel of all."""
    return tuple(
        Hypothesis(f"sensor-delay {channel}", "sensor", (Wide(key),), (channel,), len(KEYS))
        for channel, key in KEYS.items()
    )


def starts(group: Group) -> tuple[float, ...]:
    """Lags to begin from."""
    return tuple(float(group.sd[0]) * start for start in STARTS)


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Delays the sensor in question."""
    (channel,) = hypothesis.on
    field, key = f"delay_{channel}", KEYS[channel]
    lag, std = float(fitted.of(key)[0]), float(fitted.std_of(key)[0])
    rig = changed(rig, "sensors", **{field: getattr(rig.sensors, field) + lag})
    return rig, (Estimate(f"{channel}.delay", lag * 1e6, std * 1e6, "us", signed=True),)


SENSOR_DELAY = Effect(
    name="sensor-delay",
    noun="a delay of one sensor",
    meaning="One channel is recorded later or earlier than the others: check filters, multiplexing and triggers of the"
    " measuring chain.",
    parameters={"delay": "delay"},
    fields=tuple(f"rig.sensors.delay_{channel}" for channel in DELAYED),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    starts=starts,
)
