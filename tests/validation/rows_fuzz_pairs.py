"""Fuzzing of gear pairs: whatever pair is taken obeys closed forms, on the lumped model and on finite elements."""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt, tan

import numpy as np
from scipy.optimize import brentq
from shared.hunting import generator, hunt, scale, told

from gearbench.bench.statics import static
from gearbench.cases import read_case
from gearbench.commands.house.checks import Check, Got
from gearbench.fem.contact.law import elastic_pair, make_law
from gearbench.fem.contact.static import ContactError, StaticCycle, static_cycle
from gearbench.fem.gear.body import condense
from gearbench.geometry import pair
from gearbench.geometry.error import GeometryError
from gearbench.rig import CaseError, Gear, Material, Rig, Support, Supports

# Phases of a cycle on finite elements; elements of a fifth of the module tell levers, shares and 2 of stiffness.
PHASES, ELEMENT = 64, 0.2
LINE_LOAD = 50e3  # force per face width, about [N/m]: deflections are small against the tip edges
# Cycles from where a tooth pair comes or goes within which deflection and tip edges may shift that.
EDGE = 0.12


def oracles() -> Got:
    """Pairs that are taken, against closed forms: base pitch, contact ratio, mean stiffness within 2 of c_gamma."""
    count = round(150 * scale())
    findings = hunt(_pair_example, count)
    return told(findings, count, "pairs")


def _pair_example(number: int) -> str | None:
    rng = generator(number, 1)
    m = float(rng.choice([1.0, 2.0, 3.0, 5.0]))
    teeth = [int(rng.integers(18, 90)) for _ in range(2)]
    shifts = [round(float(rng.uniform(-0.1, 0.4)), 3) for _ in range(2)]
    width = round(float(rng.uniform(8, 14)) * m, 3)
    chosen: list[str] = []
    for side, z, x in zip(("driver", "driven"), teeth, shifts, strict=True):
        hub = round(0.7 * m * (z / 2 - 1.5), 3)
        values = {"teeth": z, "module_mm": m, "profile_shift": x, "face_width_mm": width, "hub_radius_mm": hub}
        # Of a disc to the tips, so that any hub's share is enough.
        radius = 1e-3 * m * (z / 2 + 2)
        mass = 7850 * pi * radius**2 * 1e-3 * width
        values |= {"mass_kg": mass, "inertia_kg_m2": mass * radius**2 / 2}
        values |= {"bore_radius_mm": 0, "tip_edge_radius_um": 0, "thinning_um": 0}
        chosen += [f"rig.{side}.{key}={value}" for key, value in values.items()]
    try:
        case = read_case("quick_lumped", chosen)
        found = pair(case.rig)
        result = static(case, positions=32, torque=[0.05 * width * teeth[0] * m * 2])
    except (CaseError, GeometryError) as error:
        return f"{error} of {chosen}"
    pitch, ratio = closed_forms(1e-3 * m, teeth, shifts)
    if abs(found.base_pitch - pitch) > 1e-9:
        return f"base pitch {found.base_pitch} and not {pitch} of {chosen}"
    if abs(found.contact_ratio - ratio) > 1e-6:
        return f"contact ratio {found.contact_ratio} and not {ratio} of {chosen}"
    mean = float(result["stiffness_tangent"].mean())
    wanted = c_gamma(teeth, shifts, ratio) * 1e-3 * width
    if not 0.5 < mean / wanted < 2.0:
        return f"stiffness {mean:.4g} N/m, c_gamma b = {wanted:.4g} N/m of {chosen}"
    return None


def closed_forms(m: float, teeth: list[int], shifts: list[float]) -> tuple[float, float]:
    """Base pitch [m] and contact ratio of two gears without tip rounding at zero backlash."""
    alpha = radians(20)
    working = working_angle(teeth, shifts)
    distance = m * sum(teeth) / 2 * cos(alpha) / cos(working)
    path = -distance * sin(working)
    for z, x in zip(teeth, shifts, strict=True):
        path += sqrt((m * (z / 2 + 1 + x)) ** 2 - (m * z / 2 * cos(alpha)) ** 2)
    pitch = pi * m * cos(alpha)
    return pitch, path / pitch


def working_angle(teeth: list[int], shifts: list[float]) -> float:
    """Working pressure angle [rad] of two gears cut at 20 degrees, at zero backlash."""
    alpha = radians(20)
    inv = tan(alpha) - alpha + 2 * sum(shifts) * tan(alpha) / sum(teeth)
    return float(brentq(lambda a: tan(a) - a - inv, 0.01, 1.2, xtol=1e-15))


def c_gamma(teeth: list[int], shifts: list[float], ratio: float) -> float:
    """c_gamma [N/m^2] of solid steel gears by ISO 6336-1, equations 82-91, for the rack 1/1.25/20 degrees."""
    (z1, z2), (x1, x2) = teeth, shifts
    q = 0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2 - 0.24188 * x2 / z2
    q += 0.00529 * x1**2 + 0.00182 * x2**2
    return 0.8 * 0.975 / q * (0.75 * ratio + 0.25) * 1e9


def elastic_oracles() -> Got:
    """Pairs on coarse finite elements: numbers of pairs, shares, torque ratio, energy of a cycle, mean stiffness."""
    count = round(4 * scale())
    return told(hunt(_elastic_example, count), count, "pairs")


def _elastic_example(number: int) -> str | None:
    rng = generator(number, 5)
    m = 1e-3 * float(rng.choice([1.0, 2.0, 3.0, 5.0]))
    teeth = [int(rng.integers(18, 50)) for _ in range(2)]
    shifts = [round(float(rng.uniform(-0.1, 0.4)), 3) for _ in range(2)]
    support, material = Support(stiffness=1e8), Material()
    driver, driven = (
        Gear(
            teeth=z,
            module=m,
            profile_shift=x,
            face_width=10 * m,
            hub_radius=0.35 * m * (z - 3),
            thinning=50e-6,
        )
        for z, x in zip(teeth, shifts, strict=True)
    )
    rig = Rig(driver=driver, driven=driven, material=material, support=Supports(driver=support, driven=support))
    which = f"of {teeth[0]}/{teeth[1]} teeth, shifts {shifts[0]:g}/{shifts[1]:g}, module {1e3 * m:g} mm"
    try:
        meshing = elastic_pair(rig)
        first, second = (condense(gear, material, ELEMENT * m, 0, "triangle") for gear in (driver, driven))
        law = make_law(meshing, first, second, material)
        torque = LINE_LOAD * driver.face_width * m * teeth[0] / 2
        cycle = static_cycle(law, np.arange(PHASES) / PHASES, torque=[torque])
    except (GeometryError, ContactError) as error:
        return f"{error} {which}"
    said = _statics(cycle, teeth, contact_path(m, teeth, shifts)) or _stiffness(cycle, rig, shifts)
    return f"{said} {which}" if said else None


def _statics(cycle: StaticCycle, teeth: list[int], path: tuple[float, float]) -> str | None:
    """What is wrong with the pairs in contact, their shares and the torques.

    Constant driver torque T1 does the work 2 pi T1 / z1 in a cycle, whatever the transmission error, and gears without
    friction give all of it to the load: the mean of T2 is T1 z2 / z1. The rectangle rule errs by less than the range
    of T2 over the number of phases.
    """
    share = cycle.load_share[0]
    if (worst := float(np.abs(share.sum(axis=1) - 1).max())) > 1e-12:
        return f"load shares add up to 1 but for {worst:.2g}"
    ratio = cycle.torque_driven[0] / cycle.torque_driver[0] * teeth[0] / teeth[1]
    entry, leave = path
    for phase, loaded, departure in zip(cycle.phase, (share > 0).sum(axis=1), np.abs(ratio - 1), strict=True):
        places = phase + np.arange(-3, 4)
        if np.abs(np.concatenate([places - entry, places - leave])).min() < EDGE:
            continue
        expected = int(((places > entry) & (places < leave)).sum())
        if loaded != expected:
            return f"{loaded} and not {expected} pairs at mesh phase {phase:g}"
        if departure > 1e-6:
            return f"torque ratio off z2/z1 by {departure:.2g} at mesh phase {phase:g}"
    if (lost := float(ratio.mean() - 1)) and abs(lost) > np.ptp(ratio) / PHASES + 1e-9:
        return f"a cycle gains {lost:.2g} of the work put in"
    return None


def _stiffness(cycle: StaticCycle, rig: Rig, shifts: list[float]) -> str | None:
    """Mean stiffness per width without the bodies' torsion between hub and root, against c_gamma."""
    gears = (rig.driver, rig.driven)
    compliance = 1 / float(cycle.stiffness_tangent.mean())
    modulus = rig.material.youngs_modulus / (2 * (1 + rig.material.poisson))
    for gear, x in zip(gears, shifts, strict=True):
        # A disc under torque about its axis: Timoshenko and Goodier 1970, section 42.
        base, root = gear.module * gear.teeth / 2 * cos(radians(20)), gear.module * (gear.teeth / 2 - 1.25 + x)
        assert gear.hub_radius is not None
        compliance -= (gear.hub_radius**-2 - root**-2) * base**2 / (4 * pi * modulus * gear.face_width)
    teeth = [gear.teeth for gear in gears]
    wanted = c_gamma(teeth, shifts, closed_forms(rig.driver.module, teeth, shifts)[1]) * rig.driver.face_width
    if not 0.5 < 1 / (compliance * wanted) < 2.0:
        return f"stiffness {1 / compliance:.4g} N/m, c_gamma b = {wanted:.4g} N/m"
    return None


def contact_path(m: float, teeth: list[int], shifts: list[float]) -> tuple[float, float]:
    """Where contact begins and ends, in base pitches from the pitch point: at the tip of the driven gear, of the
    driver."""
    working = working_angle(teeth, shifts)
    ends = []
    for z, x in zip(teeth, shifts, strict=True):
        base = m * z / 2 * cos(radians(20))
        ends.append((sqrt((m * (z / 2 + 1 + x)) ** 2 - base**2) - base * tan(working)) / (pi * m * cos(radians(20))))
    return -ends[1], ends[0]


CHECKS = [
    Check("fuzz-oracles", "pairs whose geometry or stiffness departs from closed forms", 0, "", oracles),
    Check(
        "fuzz-oracles-fe",
        "pairs on finite elements off in shares, torque ratio, energy of a cycle, or by 2 from c_gamma",
        0,
        "",
        elastic_oracles,
    ),
]
