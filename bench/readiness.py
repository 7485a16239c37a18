"""What `mesh`, `static` and `simulate` would refuse of a case's gears, found before anything is meshed or solved."""

from __future__ import annotations

from gearbench.bench.plan.excitation import comb_for
from gearbench.bench.plan.schedule import schedule
from gearbench.bench.refusals.effects import (
    ELASTIC_KEYS,
    cycles_to_repeat,
    is_nonlinear,
    refuse_effects,
    refuse_unknown,
)
from gearbench.geometry import Profile, body, pair
from gearbench.geometry.mesh.element_size import flank_size
from gearbench.geometry.mesh.sector import refuse_crack
from gearbench.geometry.tooth.iso1328 import drawn_gear
from gearbench.geometry.tooth.micro import check_micro, check_play
from gearbench.rig import Case, Gear, Rig


def check_gears(rig: Rig) -> None:
    """Raise GeometryError for a pair that cannot run, for masses, and for flanks that no tooth can have: relief and
    tables that miss the involute or are too deep, errors that jam the teeth, a crack that runs out of its tooth, a
    grade that ISO 1328-1 has no tolerance for."""
    meshing = pair(rig)
    sides: tuple[tuple[str, Profile, Gear], ...] = (
        ("rig.driver", meshing.driver, rig.driver),
        ("rig.driven", meshing.driven, rig.driven),
    )
    real = []
    for name, shape, gear in sides:
        body(shape, gear, rig.material.density, name)
        real.append(drawn_gear(gear, name))
        check_micro(shape, real[-1], name)
        if gear.crack is not None and gear.crack.length:
            # Imported on use: few gears have a crack.
            from gearbench.geometry.tooth.crack import slit

            slit(shape, gear, gear.crack, name)
    check_play(meshing.backlash_normal, (real[0], real[1]))


def check_model(case: Case) -> None:
    """Raise BenchError or GeometryError for what the case's model does not represent or cannot mesh, and for a mean
    torque beyond the loads that it knows."""
    rig, simulation = case.rig, case.simulation
    for gear in (rig.driver, rig.driven):
        flank_size(gear.module, simulation.element_size)
    reduced = simulation.model == "reduced"
    if reduced:
        for name, gear in (("rig.driver", rig.driver), ("rig.driven", rig.driven)):
            refuse_crack(gear, simulation.element, name, "simulation.element")
        refuse_effects(rig, "reduced finite-element model", represented=ELASTIC_KEYS)
    elif is_nonlinear(case):
        refuse_unknown(rig)
    if reduced or simulation.mesh_stiffness == "finite-element":
        # Imported on use: it brings in Numba.
        from gearbench.bench.refusals.load_range import check_torque
        from gearbench.fem.contact.law import elastic_pair

        meshing = elastic_pair(rig)
        for experiment in experiments_of(case):
            check_torque(meshing, experiment.experiment.torque_mean, "experiment.torque_mean_nm")


def check_timing(case: Case) -> None:
    """Raise BenchError if one of the case's experiments cannot be timed."""
    for experiment in experiments_of(case):
        reduced = case.simulation.model == "reduced"
        schedule(experiment.experiment, experiment.rig, cycles_to_repeat(experiment.rig) if reduced else 1)
        comb_for(experiment.experiment, experiment.rig)


def experiments_of(case: Case) -> list[Case]:
    """The case under each of its conditions, or the case itself."""
    return [case.under(condition) for condition in case.conditions] or [case]


def check_case(case: Case) -> None:
    """Raise what the commands that take this case would raise, one sentence, as far as that needs no solution."""
    check_gears(case.rig)
    check_model(case)
    check_timing(case)
