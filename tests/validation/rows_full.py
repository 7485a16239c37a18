"""The reduced rig against the unreduced one: the paper's finite-element case, and speed with loss of contact; and the
unreduced one against itself with contact of plain elements."""

from __future__ import annotations

from functools import cache

import numpy as np
from shared.full_runs import SideBySide, side_by_side
from shared.surface_cycles import cycle

from gearbench.bench.plan.excitation import torque_realisation
from gearbench.cases import case_path
from gearbench.commands.house.checks import Check, Got
from gearbench.rig import Damping, Gear, Rig, Simulation, Support, Supports, read_case

HIGHEST = 3000.0  # [Hz]
STEPS_PER_SECOND = 65536.0

# One mesh period of paper_fe is half a second: at the paper's speed the full model takes most of an hour for it. At
# 64 Hz mesh frequency the same period, with the same torque, passes in 1/64 s. Elements of module / 2.
PAPER = ("experiment.mesh_frequency_hz=64", "simulation.element_size_um=1000")

FAST = Gear(teeth=20, module=3e-3, face_width=0.02, hub_radius=0.021, thinning=40e-6, inertia=2e-3)


@cache
def paper() -> SideBySide:
    """One mesh period of the paper's case, faster."""
    case = read_case(case_path("paper_fe"), PAPER)
    experiment = case.experiment
    steps = int(STEPS_PER_SECOND / 64)
    per_period = int(STEPS_PER_SECOND * experiment.samples_per_period / experiment.sampling_rate)
    torque = torque_realisation(experiment, 0, case.rig).sample(per_period)[1 : steps + 1]
    return side_by_side(case.rig, case.simulation, 64.0, STEPS_PER_SECOND, torque, experiment.torque_mean)


@cache
def fast() -> SideBySide:
    """20/20 teeth at 5100 rpm, close to resonance, hardly damped: thirteen mesh periods from rest on, with impacts."""
    support = Support(stiffness=1e9, damping=1e3)
    rig = Rig(
        driver=FAST,
        driven=FAST,
        support=Supports(driver=support, driven=support),
        damping=Damping(material_ratio=1e-6 * np.pi * 1250),
    )
    return side_by_side(rig, Simulation(element_size=1.5e-3), 1700.0, 131072.0, np.full(1000, 20.0), 20.0)


def contact_loss() -> Got:
    """Difference of both models, with the share of the time that the teeth are apart."""
    run = fast()
    apart = float(np.mean(run.full_loaded == 0))
    if not apart:
        raise ValueError("the fast case no longer loses contact")
    return Got(run.difference(HIGHEST), f"teeth apart for {apart:.1%} of the time")


def surfaces() -> Got:
    """Mean difference of the static TE by contact of the elements' own surfaces, with its ripple."""
    off = cycle(0.15e-3, 200.0, 48).off
    return Got(abs(float(off.mean())), f"ripple {off.std():.1%} rms, {np.ptp(off):.1%} peak to peak")


CHECKS = [
    Check(
        "full-transient",
        "reduced against full over one mesh period of paper_fe, DTE without its mean, to 3 kHz, rms",
        0.01,
        "",
        lambda: paper().difference(HIGHEST),
    ),
    Check(
        "full-contact-loss",
        "reduced against full at 5100 rpm with loss of contact, DTE without its mean, to 3 kHz, rms",
        0.01,
        "",
        contact_loss,
    ),
    Check(
        "full-penalty",
        "contact of the elements' surfaces (150 um) against the contact law, mean TE of a mesh cycle",
        0.01,
        "",
        surfaces,
    ),
]
