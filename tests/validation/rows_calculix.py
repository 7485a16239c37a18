"""Stored runs of CalculiX beside ours: the contact models that `mesh --out pair.inp` writes, root stress, and a step of
torque on a pair in motion."""

from __future__ import annotations

from shared.contact_models import RUNS, difference
from shared.root_stresses import FINEST, roots
from shared.torque_steps import REFERENCE, apart

from gearbench.commands.house.checks import Check, Got


def contact_models(on_line: bool) -> float:
    """Largest relative difference of either torque from the stored runs on the line of action, or at tip edges."""
    return max(difference(run) for run in RUNS if run["on_line"] == on_line)


def root_stresses() -> float:
    """Largest relative difference of the tension in the fillets of all loaded teeth."""
    return max(abs(root.own_stress / root.stress - 1) for position in FINEST for root in roots(position))


def in_motion(what: str) -> Got:
    """The worse of both models' differences of the period, or of the DTE, from the reference run."""
    found = {model: abs(getattr(apart(model, **REFERENCE), what)) for model in ("full", "reduced")}
    return Got(max(found.values()), ", ".join(f"{model} {value:.2%}" for model, value in found.items()))


CHECKS = [
    Check(
        "deck-line",
        "torque of the contact model of `mesh --out pair.inp` against CalculiX, on the line of action",
        5e-3,
        "",
        lambda: contact_models(True),
    ),
    Check(
        "deck-corner",
        "torque of the contact model of `mesh --out pair.inp` against CalculiX, at tip corners",
        1e-2,
        "",
        lambda: contact_models(False),
    ),
    Check(
        "full-calculix-period",
        "vibration after a step of torque against CalculiX's *DYNAMIC: period of the first mode",
        1e-2,
        "",
        lambda: in_motion("period"),
    ),
    Check(
        "full-calculix-dynamic",
        "vibration after a step of torque against CalculiX's *DYNAMIC: DTE, rms over rms",
        3e-2,
        "",
        lambda: in_motion("dte"),
    ),
    Check("root-stress", "largest tension in the tooth roots against CalculiX", 1e-2, "", root_stresses),
]
