"""What turns with a shaft in the transmission error: a gear that is off centre, or the disc of its encoder."""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import GEARS, Look

Array = NDArray[np.float64]

# Orders of a shaft that are looked at, and fewest of its turns.
ORDERS, TURNS = (1, 2), 1.5
# Part of the dte's power that is said: where the record holds whole turns, and else, when it leaks into all lines; how
# near to whole, and by how much an order exceeds what lies midway between orders.
SHARE, LEAKS, WHOLE, STANDS_OUT = 0.05, 0.002, 0.01, 10.0
# Orders of both shafts are told apart where they part by so many cycles along the record.
APART = 0.5
# Samples that are looked at, evenly spread.
MOST = 20_000


def shafts_turn_true(look: Look) -> list[Finding]:
    """No order of a shaft stands out of the dte: it repeats with the turn, not with the mesh, and is no response to the
    excitation."""
    error = look.stored_or_own_dte
    step = max(1, look.samples // MOST)
    turned = {gear: angle[::step] for gear in GEARS if (angle := look.channel(f"angle_{gear}")) is not None}
    turned = {gear: angle for gear, angle in turned.items() if np.ptp(angle) > 2 * pi * TURNS}
    if error is None or not turned:
        return []
    swing = error[::step] - error.mean()
    slow = np.stack([np.ones(swing.size), np.linspace(-1.0, 1.0, swing.size)])
    swing -= slow.T @ np.linalg.lstsq(slow.T, swing, rcond=None)[0]
    places: list[tuple[str, int]] = []
    for gear, order in ((gear, order) for gear in turned for order in ORDERS):
        cycles = [abs(order * np.ptp(turned[gear]) - own * np.ptp(turned[of])) / (2 * pi) for of, own in places]
        if min(cycles, default=APART) >= APART:
            places.append((gear, order))
    sizes, left = _amplitudes(swing, slow, [order * turned[gear] for gear, order in places])
    between, _ = _amplitudes(left, slow, [(order + 0.5) * turned[gear] for gear, order in places])
    largest = int(np.argmax(sizes))
    gear, order = places[largest]
    share = 0.5 * float(sizes[largest]) ** 2 / max(float(np.mean(swing**2)), np.finfo(float).tiny)
    turns = float(np.ptp(turned[gear])) / (2 * pi) * swing.size / (swing.size - 1)
    limit = SHARE if abs(order * turns - round(order * turns)) < WHOLE else LEAKS
    if share < limit or sizes[largest] ** 2 < STANDS_OUT * between.max() ** 2:
        return []
    return [
        Finding(
            f"the dte holds {1e6 * sizes[largest]:.2g} um at order {order} of the {gear}'s shaft, {share:.2g} of its"
            f" power (limit {limit:g}): run-out of the gear or of its encoder, which is no response to the excitation"
            " (runout_orders of a channel map takes an encoder's off)",
            refused=False,
        )
    ]


def _amplitudes(values: Array, slow: Array, phases: list[Array]) -> tuple[Array, Array]:
    """Amplitudes (P,) of sines of phases (P, n) in values (n,), fitted with what is slow (S, n), and the rest."""
    waves = [wave(phase) for phase in phases for wave in (np.cos, np.sin)]
    columns = np.stack([*waves, *slow], axis=1)
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    pairs = found[: len(waves)].reshape(-1, 2)
    return np.hypot(pairs[:, 0], pairs[:, 1]), values - columns @ found
