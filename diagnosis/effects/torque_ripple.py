"""Ripple of the driving torque at fixed orders of the rotation, which the recorded torque does not hold."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, hypot

import numpy as np
from numpy.typing import NDArray

from gearbench.diagnosis.effects.effect import Added, Effect, Estimate, Fitted, Hypothesis, Wide, changed
from gearbench.diagnosis.forces.condition import Condition
from gearbench.diagnosis.forces.drive_orders import missing_orders
from gearbench.diagnosis.forces.nominal import NominalModel
from gearbench.diagnosis.forces.unknowns import Group, Unknowns, group
from gearbench.rig import Rig
from gearbench.rig.drive import Ripple

Array = NDArray[np.float64]

KEY = "ripple"
ORDERS = (6, 12, 18, 24)  # per driver revolution: what commutation and slots of usual motors leave
# Others are looked at where the records show them without any law of the mesh: so many, the strongest.
MORE = 4
# Amplitude over the mean torque: 0.6 % is severity 1 of the truth rigs; good motors leave a tenth.
SD, WIDE = 0.0006, 0.006
PARTS = {"cos": 0.5, "sin": -0.5j}  # what a cosine or sine of amplitude 1 adds to its bin


def orders_of(model: NominalModel, conditions: Sequence[Condition]) -> tuple[int, ...]:
    """Orders of the driver's rotation that are looked at: the usual ones, and those that the drive lacks torque at, by
    half of `WIDE` or more in all conditions."""
    missing = missing_orders(model, conditions, 0.5 * WIDE)
    strongest = [int(at) + 1 for at in np.argsort(-missing)[:MORE] if missing[at] > 0.0]
    return tuple(sorted({*ORDERS, *strongest}))


def orders_in(unknowns: Unknowns) -> tuple[int, ...]:
    """The orders that unknowns have, ascending."""
    return tuple(sorted({order for _, order, _ in _listed(unknowns)}))


def _listed(unknowns: Unknowns) -> Iterator[tuple[str, int, str]]:
    """Condition, order and part of every unknown, in their order."""
    for name in unknowns.group(KEY).names:
        condition, order, part = name.rsplit(":", 2)
        yield condition, int(order), part


def unknowns(model: NominalModel, conditions: Sequence[Condition]) -> tuple[Group, ...]:
    """Cosine and sine part of every order in every condition: motors ripple with their load."""
    orders = orders_of(model, conditions)
    listed = [(one.name, order, part) for one in conditions for order in orders for part in PARTS]
    names = [f"{name}:{order}:{part}" for name, order, part in listed]
    torque = float(np.mean([one.torque_mean for one in conditions]))

    def lines(condition: Condition) -> NDArray[np.complex128]:
        out = np.zeros((len(listed), condition.bins), dtype=complex)
        for entry, (name, order, part) in enumerate(listed):
            if name == condition.name:
                out[entry, order * condition.cycles // condition.teeth[0]] = PARTS[part]
        return out

    return (group(KEY, "N m", names, SD * torque, WIDE * torque, slot="torque", basis=lines),)


def hypotheses(model: NominalModel) -> tuple[Hypothesis, ...]:
    """All orders together."""
    return (Hypothesis("torque-ripple", "drive", (Wide(KEY),)),)


def _average(values: Array, stds: Array, chosen: list[int]) -> float:
    """Mean of the chosen values, the better known ones before the others."""
    return float(np.average(values[chosen], weights=stds[chosen] ** -2.0))


def add(rig: Rig, hypothesis: Hypothesis, fitted: Fitted) -> Added:
    """Gives the drive one ripple for all conditions: the mean of theirs."""
    listed, values, stds = tuple(_listed(fitted.unknowns)), fitted.of(KEY), fitted.std_of(KEY)
    orders = orders_in(fitted.unknowns)
    amplitudes, phases, out = [], [], []
    for order in orders:
        chosen = [i for i, (_, own, _) in enumerate(listed) if own == order]
        parts = [[i for i in chosen if listed[i][2] == part] for part in PARTS]
        cosine, sine = (_average(values, stds, part) for part in parts)
        amplitudes.append(hypot(cosine, sine))
        # A cos(o theta + phase) = A cos(phase) cos - A sin(phase) sin.
        phases.append(atan2(-sine, cosine))
        std = float(np.sqrt(2 / (1 / stds[chosen] ** 2).sum()))
        torques = np.array([fitted.torque_mean[listed[i][0]] for i in chosen])
        mean = float(np.average(torques, weights=stds[chosen] ** -2.0))
        out.append(Estimate(f"order_{order}.relative_amplitude", amplitudes[-1] / mean, std / mean, "1"))
    ripple = Ripple(orders=orders, amplitude=tuple(amplitudes), phase=tuple(phases))
    return changed(rig, "drive", ripple=ripple), tuple(out)


TORQUE_RIPPLE = Effect(
    name="torque-ripple",
    noun="ripple of the driving torque",
    meaning="The motor's torque swings with its rotation beyond what was recorded: check its control, or measure the"
    " torque between motor and gear.",
    parameters={"relative_amplitude": "amplitude over the mean torque of the conditions"},
    fields=("rig.drive.ripple",),
    hypotheses_of=hypotheses,
    add=add,
    unknowns=unknowns,
    # rms on the calibration family (benchmarks/diagnosis_log.md)
    model_error=0.03,
    force_error=0.13,
)
