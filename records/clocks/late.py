"""Channels, and devices with several of them, that lag behind the others: told by the mesh force, and what it costs."""

from __future__ import annotations

from dataclasses import dataclass

from gearbench.records.clocks.delays import Delays, delays_of
from gearbench.records.clocks.devices import error_of_lag, far_side, late_device
from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import Look
from gearbench.records.seen.mesh_force import Accounts, accounts_of, explains

# Error of the response that counts.
MATTERS = 0.02
# A delay is believed when it leaves no more than EXACT, or FLOOR times the misfit of accounts without that channel:
# what lies between a torque and its gear, such as a soft coupling, looks like a delay in part only. Under noise the
# accounts that it repairs are left with what the others have, NOISE times at most, and were CLEARLY worse before.
EXACT, FLOOR = 0.06, 3.0
NOISE, CLEARLY = 1.5, 1 / 1.5
# A device with several channels is late, rather than one of them, where that leaves so much less.
BETTER = 0.5
# Misfit below which no delay is looked for.
SUSPICIOUS = 0.03
# Friction pushes the centres too, a little out of step.
SUSPICIOUS_Y = 0.15


@dataclass(frozen=True)
class Lag:
    """`channels`, in words `what`, late by `delay` [s] behind all others; `left`: misfit of the accounts without it."""

    what: str
    channels: frozenset[str]
    delay: float
    left: float


def lag_of(look: Look, accounts: Accounts) -> Lag | None:
    """The channel, or the device, whose lag makes the accounts of the mesh force agree; None where none does."""
    delays = Delays(accounts, delays_of(look, accounts.omega))
    best = _late_channel(delays)
    device = late_device(delays)
    device = far_side(look, accounts) if device is None and best is None else device
    if device is not None and (best is None or device[0] < BETTER * best.left):
        return Lag(f"the {device[1]} ({', '.join(sorted(device[2]))})", device[2], device[3], device[0])
    return best


def _late_channel(delays: Delays) -> Lag | None:
    """The single channel that is late, if one is."""
    accounts = delays.accounts
    best: Lag | None = None
    for name in _suspects(accounts):
        relations = [relation for relation in accounts.relations() if name in accounts.channels(relation)]
        misfits = [float(accounts.misfit(relation)[0]) for relation in relations]
        # A late y spoils both accounts with it alike: one that fits clears it. A late torque or angle shows between
        # the gears, and may hide in the damping that is fitted to a support.
        y = name.startswith("y_")
        now = min(misfits) if y else max(misfits)
        if now < (SUSPICIOUS_Y if y else SUSPICIOUS):
            continue

        delay, after = delays.best(relations, frozenset([name]))
        others = [relation for relation in accounts.relations() if relation not in relations]
        floor = max((float(accounts.misfit(relation)[0]) for relation in others), default=0.0)
        # Accounts that disagree as much without the channel do not say that it is late: bodies that twist do that.
        if floor > CLEARLY * now:
            continue
        # A delay that is one spoils no account: where a resonance is most of the force, half its period turns it over.
        turned = delays.misfits(relations, frozenset([name]), delay)
        if any(spoilt > max(EXACT, NOISE * had) for spoilt, had in zip(turned, misfits, strict=True)):
            continue
        clean = after < max(EXACT, FLOOR * floor) and explains(now, after)
        noisy = after < NOISE * floor and after < CLEARLY * now
        if (clean or noisy) and (best is None or after < best.left):
            best = Lag(name, frozenset([name]), delay, after)
    return best


def clocks_agree(look: Look) -> list[Finding]:
    """No channel, and no device with several of them, lags behind the others: a delay does not make the mesh forces
    agree."""
    accounts = accounts_of(look)
    lag = None if accounts is None else lag_of(look, accounts)
    if lag is None:
        return []
    delay = lag.delay
    error = error_of_lag(look, lag.channels, delay)
    if error < MATTERS and abs(delay) < 0.1 / look.rate:
        return []
    several = len(lag.channels) > 1
    words = ("lag behind" if delay > 0 else "lead") if several else ("lags behind" if delay > 0 else "leads")
    late = 1e6 * abs(delay)
    size = f"{late:.4g}" if late < 1e4 else f"{late:.0f}"
    return [
        Finding(
            f"{lag.what} {words} the other channels by {size} us ({abs(delay) * look.rate:.3g} samples),"
            " which the balance of forces at the gears shows (delay_s of a channel map takes it off); it costs about"
            f" {error:.0%} of the response",
            refused=False,
            error=error,
        )
    ]


def _suspects(accounts: Accounts) -> list[str]:
    return sorted(set().union(*(accounts.channels(relation) for relation in accounts.relations())))
