"""A coarse pair of like gears, 20 teeth of module 3 mm: the smallest finite-element rig that tests of motion share."""

from __future__ import annotations

from pathlib import Path

from gearbench.rig import Case, read_case

GEAR = """teeth = 20
module_mm = 3.0
face_width_mm = 20.0
hub_radius_mm = 21.0
thinning_um = 40.0
"""
RIG = f"""
[rig]
centre_distance_mm = 60.0
[rig.driver]
{GEAR}
[rig.driven]
{GEAR}
[simulation]
model = "reduced"
mesh_stiffness = "finite-element"
element_size_um = 600.0
[experiment]
torque_mean_nm = 50.0
"""
SLOW = """sampling_rate_hz = 2048.0
samples_per_period = 512
mesh_frequency_hz = 4.0
"""
HEAVY = ("rig.driver.inertia_kg_m2=2e-3", "rig.driven.inertia_kg_m2=2e-3")


def supports(stiffness: str, damping: str) -> tuple[str, str]:
    """Settings of both supports, N/m and N s/m."""
    return f"rig.support.stiffness_n_per_m={stiffness}", f"rig.support.damping_n_s_per_m={damping}"


def twin_case(folder: Path, *settings: str, experiment: str = SLOW) -> Case:
    """The pair in `folder`, at 50 N m; `experiment`: lines that end its table; `settings` as those of `--set`.

    `SLOW` is a period of mesh of 0.25 s, in which the pair moves as at rest.
    """
    file = folder / "twins.toml"
    file.write_text(f'name = "twins"\n{RIG}{experiment}', encoding="utf-8")
    return read_case(file, list(settings))
