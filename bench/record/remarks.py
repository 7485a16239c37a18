"""Sentences that a record carries of what happened in it, where there is something to say."""

from __future__ import annotations

from gearbench.bench.plan.schedule import Schedule


def divided_steps(divided: int, total: int) -> str | None:
    """A sentence for a record with steps that had to be divided, else None."""
    if not divided:
        return None
    return f"{divided} of {total} integration steps were divided, because contact changes too fast for whole ones there"


def beyond_model(strayed: int, total: int, first: float) -> str | None:
    """A sentence for a motion that goes where the flanks are not modelled, `first` at that time [s]; else None."""
    if not strayed:
        return None
    return (
        f"in {strayed} of {total} samples, first at t = {first:.6g} s, teeth overlap beyond the modelled flanks or"
        " press harder than modelled: what happens there and afterwards is beyond the model's validity; lower"
        " experiment.torque_mean_nm or the multisine"
    )


def lost_contact(lost: int, total: int) -> str | None:
    """Warning where the teeth separate: the response then is not that of a linear system."""
    if not lost:
        return None
    return (
        f"the teeth are out of contact in {lost} of {total} samples, so the rig is not linear and its identified"
        " response depends on the excitation"
    )


def unlike_periods(plan: Schedule) -> str | None:
    """Warning where the mesh period is not the period of what happens."""
    if plan.repeat_cycles == 1 or plan.rotation is not None:
        return None
    after = (
        f"mesh periods differ from one another, so the rig repeats after {plan.repeat_cycles} mesh periods"
        f" ({plan.repeat_cycles * plan.mesh_period:.4g} s)"
    )
    return after if plan.wraps else f"{after}, longer than the record: none of its excitation periods is like another"


def unsettled(residual: float, tolerance: float, undamped: str = "") -> str | None:
    """A sentence for a motion that still changes from period to period when free vibrations have died out, or never do;
    undamped: keys that damp some of them, and are 0."""
    if residual <= tolerance:
        return None
    return (
        f"the motion does not repeat: in the end the DTE still changes by {residual:.2g} of its standard deviation"
        f" (settling_tolerance: {tolerance:g}), as where teeth part and strike"
        + (f", or where vibrations are not damped ({undamped})" if undamped else "")
    )


def joined(*warnings: str | None) -> str | None:
    """The sentences as an attribute, a line each; None without any."""
    return "\n".join(filter(None, warnings)) or None
