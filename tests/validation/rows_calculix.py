"""Stored runs of CalculiX beside ours: the contact models that `mesh --out pair.inp` writes, and root stress."""

from __future__ import annotations

from shared.contact_models import RUNS, difference
from shared.root_stresses import FINEST, roots

from gearbench.commands.checks import Check


def contact_models(on_line: bool) -> float:
    """Largest relative difference of either torque from the stored runs on the line of action, or at tip edges."""
    return max(difference(run) for run in RUNS if run["on_line"] == on_line)


def root_stresses() -> float:
    """Largest relative difference of the tension in the fillets of all loaded teeth."""
    return max(abs(root.own_stress / root.stress - 1) for position in FINEST for root in roots(position))


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
    Check("root-stress", "largest tension in the tooth roots against CalculiX", 1e-2, "", root_stresses),
]
