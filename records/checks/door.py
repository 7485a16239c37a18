"""The checks in their order, and what becomes of what they find."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import xarray as xr

from gearbench.records.checks.angles import (
    angles_follow_mesh_phase,
    angles_keep_mesh_period,
    angles_roll,
    angles_unwrapped,
    radii_fit_inertias,
    radii_fit_teeth,
)
from gearbench.records.checks.boundary import (
    accelerations_as_torques,
    boundary_as_declared,
    inertias_as_declared,
)
from gearbench.records.checks.clipping import not_clipped
from gearbench.records.checks.contradictions import (
    displacements_fit,
    gears_not_swapped,
    load_torque_alive,
    torques_fit_inertias,
)
from gearbench.records.checks.copies import realisations_differ
from gearbench.records.checks.derived import (
    centres_alive,
    dte_alive,
    response_is_a_gears,
    spring_is_a_mesh,
    stored_as_channels_have_it,
    swings_fit_the_teeth,
)
from gearbench.records.checks.mesh_lines import mesh_lines_stand_out
from gearbench.records.checks.passive import force_feeds_the_rig
from gearbench.records.checks.periods import force_repeats_as_declared, periods_repeat
from gearbench.records.checks.run_out import shafts_turn_true
from gearbench.records.checks.torques import load_balances, torque_as_declared
from gearbench.records.clocks.drift import clocks_keep_pace
from gearbench.records.clocks.dropouts import channels_do_not_stick
from gearbench.records.clocks.lag import force_and_dte_in_step
from gearbench.records.clocks.late import clocks_agree
from gearbench.records.clocks.lost import channels_keep_step, periods_keep_step
from gearbench.records.clocks.sampled import sampled_fast_enough
from gearbench.records.clocks.slips import angles_do_not_slip, gears_pass_the_same_teeth, no_gap_in_all_channels
from gearbench.records.errors import RecordError
from gearbench.records.seen.finding import Finding
from gearbench.records.seen.look import Look

Check = Callable[[Look], list[Finding]]

# What is said first explains most: a record in degrees fails later checks too.
CHECKS: tuple[Check, ...] = (
    realisations_differ,
    radii_fit_teeth,
    radii_fit_inertias,
    angles_unwrapped,
    no_gap_in_all_channels,
    angles_do_not_slip,
    angles_roll,
    angles_keep_mesh_period,
    angles_follow_mesh_phase,
    gears_pass_the_same_teeth,
    force_repeats_as_declared,
    mesh_lines_stand_out,
    torque_as_declared,
    load_balances,
    dte_alive,
    centres_alive,
    swings_fit_the_teeth,
    gears_not_swapped,
    torques_fit_inertias,
    accelerations_as_torques,
    displacements_fit,
    force_feeds_the_rig,
    stored_as_channels_have_it,
    response_is_a_gears,
    spring_is_a_mesh,
    load_torque_alive,
    boundary_as_declared,
    inertias_as_declared,
    not_clipped,
    channels_do_not_stick,
    shafts_turn_true,
    sampled_fast_enough,
    clocks_agree,
    channels_keep_step,
    periods_keep_step,
    force_and_dte_in_step,
    clocks_keep_pace,
    periods_repeat,
)


def check_record(record: xr.Dataset, source: str = "", checks: Sequence[Check] = CHECKS) -> tuple[Finding, ...]:
    """What must be said of a record that `validate_record` has passed: findings that are not refused.

    Each check uses the attributes and channels that are there and is silent where it cannot know. Raises RecordError
    with the sentence of the first finding that is refused; `source` is what the sentence calls the record.

    >>> import gearbench as gb
    >>> from gearbench.records.checks import check_record
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"]))
    >>> check_record(record)
    ()
    >>> record["y_driver"] = -record["y_driver"].assign_attrs(units="m")
    >>> try:
    ...     check_record(record)
    ... except gb.records.RecordError as error:
    ...     print(str(error)[:45])
    y_driver moves against the force of the teeth
    """
    look = Look(record)
    found: list[Finding] = []
    for check in checks:
        for finding in check(look):
            if finding.refused:
                raise RecordError(f"{source}: {finding.sentence}" if source else finding.sentence)
            found.append(finding)
    return tuple(found)
