"""What to measure next, as far as the records themselves tell."""

from __future__ import annotations

from collections.abc import Sequence

from gearbench.diagnosis.intake.measurements import Measurement

# Mean torques or speeds further apart than this ratio are two.
APART = 1.1

PARTED = (
    "Add a record whose flanks stay together, under a heavier load or a smaller swing of the torque: they part in every"
    " record to search from, or the nominal rig does not settle there, so that no simulation can follow these and the"
    " force residuals decide alone."
)


def advice_of(measurements: Sequence[Measurement], held_out: Measurement | None) -> tuple[str, ...]:
    """Sentences about what these records lack; none if they hold all that diagnosis can use."""
    everything = [*measurements, *([held_out] if held_out else [])]
    said = []
    for channel, words in (
        ("y_driver", "the displacement of the driver (y_driver)"),
        ("y_driven", "the displacement of the driven gear (y_driven)"),
        ("torque_driven", "the torque at the load (torque_driven)"),
    ):
        lacking = [one.name for one in everything if channel not in one.periods]
        if lacking:
            said.append(f"Measure {words}: it is missing in {', '.join(lacking)}.")
    single = [one.name for one in everything if one.repetitions < 2]
    if single:
        said.append(f"Record two hunting periods or more: there is one only in {', '.join(single)}.")
    adrift = [one.name for one in everything if one.drift]
    if adrift:
        said.append(f"Let the rig warm up and the sensors settle: {', '.join(adrift)} drifted while recording.")
    if any(not one.phase_known for one in everything):
        said.append("Refer the mesh phase to the teeth (an index pulse at tooth 0): single teeth can then be named.")
    torques = [float(one.mean("torque_driver").mean()) for one in measurements]
    speeds = [one.mesh_frequency for one in measurements]
    if max(torques) < APART * min(torques):
        said.append("Add a record at another mean torque: effects of load can then be told from those of position.")
    if max(speeds) < APART * min(speeds):
        said.append("Add a record at another speed: effects of time can then be told from those of rotation.")
    if held_out is None:
        said.append(
            "Add a record with other phases, to be held out: only such a record shows how far the gap shrinks on data"
            " that were not fitted."
        )
    return tuple(said)
