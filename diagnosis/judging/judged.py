"""A judged record, and what the rig that was found leaves of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Hypothesis
from gearbench.diagnosis.intake.measurements import Measurement
from gearbench.diagnosis.intake.signals import measured_channels
from gearbench.diagnosis.judging.along import CLOSER, FLOORS, Along
from gearbench.diagnosis.judging.closing import Closing, energy_of
from gearbench.diagnosis.selection.simulated import Simulated
from gearbench.diagnosis.selection.weighing import Weighed
from gearbench.diagnosis.simulation.target import FITTED, Target

Array = NDArray[np.float64]
Report = Callable[[str], None]

# Of the nominal gap, rms over rms and all channels in units of their own fluctuation: more than this part left is "the
# greater part".
GREATER = 0.5
# Of what the rig without any effect leaves, from which one with effects goes another way.
ASTRAY = 1.5
NOTHING = 1e-9  # of the nominal gap: no less is left than this, where noise is all that is


@dataclass(frozen=True)
class Judged:
    """A selection on the judged record `measured`: `found` with the effects that are kept, what each closes by its
    hypothesis' name, the signals (channel -> (N,)) of the nominal rig, of the one without any of them and with all of
    them, what was entered but closes nothing, the lines of that record, by channel the parts of its noise, and the
    signals with all effects `kept` on the record's way where the rig goes another by itself (None elsewhere)."""

    measured: Measurement
    found: Simulated
    closings: Mapping[str, Closing]
    nominal: Mapping[str, Array]
    plain: Mapping[str, Array]
    signals: Mapping[str, Array]
    dropped: tuple[Weighed, ...] = ()
    target: Target | None = None
    noise: Mapping[str, Array] = field(default_factory=dict)
    kept: Mapping[str, Array] | None = None

    def with_dropped(self, before: Sequence[Weighed]) -> Judged:
        """With what was entered and dropped `before`, when other effects were there, but for what is kept now."""
        now = {one.hypothesis.name for one in (*self.found.selection.entered, *self.dropped)}
        return replace(self, dropped=(*(one for one in before if one.hypothesis.name not in now), *self.dropped))

    @cached_property
    def sizes(self) -> dict[str, Sizes]:
        """Rms values by channel."""
        out = {}
        for channel, repetitions in measured_channels(self.measured).items():
            if channel not in FITTED or channel not in self.signals:
                continue
            mean = repetitions.mean(axis=0)
            noise = self._rms(self.noise[channel]) if channel in self.noise else 0.0
            nominal, plain, final = (self._rms(mean - one[channel]) for one in (self.nominal, self.plain, self.signals))
            out[channel] = Sizes(self._rms(mean), nominal, plain, final, noise)
        return out

    def _rms(self, values: Array) -> float:
        """Rms of a signal (N,), or of parts (parts, N) that add up by their squares, up to the highest line that the
        search sees: beyond the excitation nothing determines the rig."""
        return max(float(np.sqrt(sum(energy_of(one)[: self.top].sum() for one in np.atleast_2d(values)))), 1e-300)

    @cached_property
    def top(self) -> int | None:
        """The highest line that the search sees; None: all."""
        return max((int(bins.max()) for _, _, bins in self.target.plan), default=None) if self.target else None

    @property
    def answer(self) -> Mapping[str, Array]:
        """The signals (channel -> (N,)) with all effects that say what is missing: those kept on the record's way where
        the rig goes another."""
        return self.signals if self.kept is None else self.kept

    def strays_from(self, kept: Mapping[str, Array]) -> bool:
        """Whether most of what the rig leaves of the transmission error is that it goes another way than the record:
        `kept` on that it leaves far less."""
        size = self.sizes.get("dte")
        if size is None or size.final <= FLOORS * size.noise:
            return False
        return self.rms_left("dte", kept) <= CLOSER * size.final

    @property
    def along(self) -> Along | None:
        """What the rig leaves by itself and kept on the record's way, where it goes another."""
        if self.kept is None:
            return None
        return Along(self.measured.name, self.rms_left("dte", self.kept), self.sizes["dte"].final)

    @cached_property
    def _left(self) -> dict[str, float]:
        """Rms by channel that `answer` leaves."""
        if self.kept is None:
            return {channel: one.final for channel, one in self.sizes.items()}
        return {channel: self.rms_left(channel, self.kept) for channel in self.sizes}

    @property
    def left(self) -> float:
        """Rms of what is left of the nominal gap, over it, all channels in units of their own fluctuation, beyond
        noise."""
        return self._part(self._left)

    @property
    def is_astray(self) -> bool:
        """Whether the rig without any effect is far closer to the record than that with what was named."""
        plain = self._part({channel: one.plain for channel, one in self.sizes.items()})
        return self.kept is None and self.left > ASTRAY * plain

    def _part(self, rms: Mapping[str, float]) -> float:
        """Rms by channel over the nominal gap, all in units of their own fluctuation, beyond noise."""
        gap = left = 0.0
        for channel, one in self.sizes.items():
            gap += max(one.nominal**2 - one.noise**2, 0.0) / one.fluctuation**2
            left += max(rms[channel] ** 2 - one.noise**2, 0.0) / one.fluctuation**2
        return float(np.sqrt(left / gap)) if gap > 0.0 else 0.0

    @property
    def beyond_noise(self) -> float:
        """What is left of the transmission error beyond its noise, rms over rms; no limit where either is not known."""
        size = self.sizes.get("dte")
        return max(self._left["dte"] / size.noise - 1.0, 0.0) if size and size.noise > 0.0 else np.inf

    @property
    def remains(self) -> float:
        """The largest part of any channel's fluctuation that is left beyond noise."""
        return self.most_left[1]

    @property
    def most_left(self) -> tuple[str, float]:
        """The channel of which most is left beyond noise, and that part of its fluctuation."""
        return max(self._remaining.items(), key=lambda pair: pair[1], default=("", 0.0))

    @property
    def _remaining(self) -> dict[str, float]:
        """By channel the part of its fluctuation that is left beyond noise."""
        return {
            channel: float(np.sqrt(max(self._left[channel] ** 2 - one.noise**2, 0.0)) / one.fluctuation)
            for channel, one in self.sizes.items()
        }

    @property
    def searched(self) -> float:
        """The same on the records that the selection was found from, whose channels are taken together."""
        return max((left for left, _ in self._searched.values()), default=0.0)

    @property
    def hidden(self) -> float:
        """The largest part of any channel's fluctuation that is left here and that the records of the search could not
        have told from what changes in them."""
        pairs = ((self._remaining.get(channel, 0.0), noise) for channel, (_, noise) in self._searched.items())
        return max((min(pair) for pair in pairs), default=0.0)

    @cached_property
    def _searched(self) -> dict[str, tuple[float, float]]:
        """By channel of the records of the search, all together: parts of its fluctuation that are left beyond noise,
        and that are noise."""
        simulator, best = self.found.simulator, self.found.selection.best
        own = None if simulator.anchored else simulator.free.lines(self.found.end_of(best))
        lines = best.lines if own is None else own
        target = simulator.target
        shares = zip(*target.shares(target.lines - lines), strict=True)
        return {block.channel: (float(a), float(b)) for block, (a, b) in zip(target.blocks, shares, strict=True)}

    def share(self, without: Mapping[str, Array]) -> float:
        """Part of the nominal gap, by energy and all channels in units of their fluctuation, that comes back in a rig
        with those signals."""
        gap = back = 0.0
        for channel, one in self.sizes.items():
            gap += max(one.nominal**2 - one.noise**2, 0.0) / one.fluctuation**2
            back += (self.rms_left(channel, without) ** 2 - self._left[channel] ** 2) / one.fluctuation**2
        return float(np.clip(back / gap, 0.0, 1.0)) if gap > 0.0 else 0.0

    def share_of(self, effect: Hypothesis) -> float:
        """The same without an effect that was held against the record."""
        return self.share(self.closings[effect.name].without)

    def rms_left(self, channel: str, signals: Mapping[str, Array]) -> float:
        """Rms that a rig with those signals leaves of a measured channel."""
        return self._rms(measured_channels(self.measured)[channel].mean(axis=0) - signals[channel])

    def grown(self, without: Mapping[str, Array]) -> float:
        """Factor by which all that is left grows in a rig with those signals, rms over rms."""
        return float(np.sqrt(1.0 + self.share(without) / max(self.left, NOTHING) ** 2))


@dataclass(frozen=True)
class Sizes:
    """Rms of one channel on the judged record, without means, up to the end of the excitation: its own, of the gap of
    the nominal rig, of the one without any effect and of the final one, and of the noise."""

    fluctuation: float
    nominal: float
    plain: float
    final: float
    noise: float
