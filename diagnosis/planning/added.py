"""Records that a plan could have besides: the first condition at another mean torque, and at another speed."""

from __future__ import annotations

from gearbench.rig import Case, Condition, Experiment
from gearbench.rig.experiment import Multisine

# Over those of the first condition.
TORQUE, SPEED = 0.5, 1.25
SEEDS = 1000  # between those of the case's own conditions and of the records added
ADDED = "added"  # name of its condition


def larger_plans(case: Case) -> dict[str, Case]:
    """The case with one more condition, by what that is in words; none of a case whose speed is not constant, or
    without a multisine. The condition stands second, so that the last one stays the last."""
    first = case.conditions[0].experiment if case.conditions else case.experiment
    named = case.conditions or (Condition(name="base", experiment=first),)
    if first.multisine is None or first.samples_per_period is None or first.speed_end or first.speed_table:
        return {}
    more = {
        "at half the mean torque": _at_torque(first, first.multisine),
        f"at {SPEED:g} times the speed": _at_speed(first, first.samples_per_period),
    }
    return {
        words: case.model_copy(update={"conditions": (named[0], Condition(name=ADDED, experiment=one), *named[1:])})
        for words, one in more.items()
    }


def _at_torque(first: Experiment, multisine: Multisine) -> Experiment:
    """The torque and its swing smaller by the same factor, so that flanks part no sooner."""
    size = {key: TORQUE * value for key in ("amplitude", "rms") if (value := getattr(multisine, key))}
    return first.model_copy(
        update={
            "torque_mean": TORQUE * first.torque_mean,
            "multisine": multisine.model_copy(update=size),
            "seed": first.seed + SEEDS,
        }
    )


def _at_speed(first: Experiment, samples: int) -> Experiment:
    """As many mesh cycles in a period of fewer samples."""
    fewer = round(samples / SPEED)
    if first.mesh_frequency is not None:
        faster = {"mesh_frequency": first.mesh_frequency * samples / fewer}
    else:
        assert first.speed_driver is not None
        faster = {"speed_driver": first.speed_driver * samples / fewer}
    return first.model_copy(update={**faster, "samples_per_period": fewer, "seed": first.seed + SEEDS + 1})
