"""A pair at one mesh phase as a static contact model for CalculiX, with the torque that we expect beside it.

Whole gears; fine elements where our own contact law finds the teeth touching (the elements' size alone depends on that,
not what CalculiX computes), coarse ones on teeth far away.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.elastic.rig import ElasticRig, elastic_rig
from gearbench.bench.errors import BenchError
from gearbench.bench.refusals.stated import mean_torque
from gearbench.fem.contact.kinematics import CORNER1, CORNER2, EDGE1, EDGE2, ON_LINE, Contact
from gearbench.fem.contact.law import PAIRS, contact_in
from gearbench.fem.contact.static import position, solve_torque, static_cycle
from gearbench.fem.gear.elasticity import plane_moduli
from gearbench.geometry.export.calculix import PENALTIES, Deck, Placement, Touch
from gearbench.geometry.mesh.assembly import assembled, outline_sides
from gearbench.geometry.mesh.grading import Grading, HalfBoundary, half_boundary, refined_boundary
from gearbench.geometry.mesh.sector_mesh import sector_within
from gearbench.geometry.mesh.values import GearMesh, SectorMesh
from gearbench.geometry.tooth.profile import Profile
from gearbench.rig import Case
from gearbench.rig.neutral import effects_in

Array = NDArray[np.float64]

# Elements over half the width of contact, and how far in half-widths they stay that small.
ACROSS = 5.0
FLAT = 1.6
LEAST_FLAT = 10e-6  # [m]
# Size where the involute's end lies near a contact: the curvature jumps there [m].
END_SIZE = 3e-6
# Size of the elements on loaded teeth and their neighbours, and of those on the others, in modules.
NEAR, FAR = 1 / 8, 1 / 2
FAR_GRADING = Grading(growth=0.7, bend=0.9, cut_edges=6, fine_tips=False)
NEAR_GRADING = Grading(growth=0.22, fine_tips=False)
# Pairs with a larger gap are left out: a gap closes by the deflection of neighbouring teeth, if at all [m].
OPEN = 2e-6
# A pair that carries nothing yet is meshed as if it carried this part of the load.
LEAST_SHARE = 0.05


@dataclass(frozen=True)
class Meeting:
    """A tooth pair near contact: driver tooth, both profiles, contact, force [N], half-width of contact [m]."""

    tooth: int
    shapes: tuple[Profile, Profile]
    contact: Contact
    force: float
    half_width: float

    @property
    def size(self) -> float:
        """Size of the elements in contact [m]."""
        return self.half_width / ACROSS

    def own_end(self, gear: int) -> float:
        """Arc length from the contact on a gear (0 driver, 1 driven) to the end of its involute; negative: beyond."""
        return self.shapes[gear].s_end - self.arc(gear)

    def place(self, gear: int, number: int) -> Array:
        """The contact (2,) in the frame of a gear in which it lies on sector `number`."""
        shape = self.shapes[gear]
        return np.asarray(_turn(shape.pitch_angle * number) @ shape.points(self.arc(gear)))

    def arc(self, gear: int) -> float:
        """Arc length of the contact on the flank of driver (0) or driven gear (1)."""
        return (self.contact.s1, self.contact.s2)[gear]


@dataclass(frozen=True)
class ContactModel:
    """The model: its deck, mesh phase [cycles], DTE [m], and what we expect: torques of driver and driven gear [N m],
    how many pairs carry, and whether all of them touch on the line of action."""

    deck: Deck
    phase: float
    dte: float
    torques: tuple[float, float]
    pairs: int
    on_line: bool

    @property
    def tolerance(self) -> float:
        """How well CalculiX should agree [%]."""
        return 0.5 if self.on_line else 1.0


def contact_model(
    case: Case, phase: float = 0.0, *, dte: float | None = None, torque: float | None = None, name: str | None = None
) -> ContactModel:
    """The pair of a case at a mesh phase [cycles] and a DTE [m], or else at the DTE of a driver torque [N m] (absent:
    the experiment's mean). `name` is how the comment calls the case.

    Raises BenchError for flanks with errors, cracks or no load, ContactError beyond the modelled flanks.
    """
    _refuse(case)
    if dte is not None and torque is not None:
        raise BenchError("the contact model takes a torque or a transmission error: give one")
    for key, value, unit in (("transmission error", dte, "m"), ("torque", torque, "N m"), ("mesh phase", phase, "")):
        if value is not None and not (np.isfinite(value) and (value > 0 or not unit)):
            limit = f"greater than 0 {unit}" if unit else "a number"
            raise BenchError(f"{f'{key} = {value:g} {unit}'.rstrip()} must be {limit}")
    elastic = elastic_rig(case.rig, case.simulation)
    if dte is None:
        wanted = mean_torque(case) if torque is None else torque
        dte = solve_torque(elastic.law, phase, wanted)
    cycle = static_cycle(elastic.law, np.array([phase]), dte=[dte])  # refuses what leaves the flanks
    torques = float(cycle.torque_driver[0, 0]), float(cycle.torque_driven[0, 0])
    met = meetings(elastic, phase, dte)
    gears = _gears(elastic, phase, met)
    deck = Deck(
        gears=gears,
        touches=tuple(_touch(gears, meeting) for meeting in met),
        rotation=dte / elastic.pair.driver.base_radius,
        material=case.rig.material,
        torques=torques,
        head=(),
    )
    on_line = all(m.contact.slave == ON_LINE or not m.force for m in met)
    model = ContactModel(deck, phase, dte, torques, sum(m.force > 0 for m in met), on_line)
    return replace(model, deck=replace(deck, head=_head(case, model, name or case.name)))


def _refuse(case: Case) -> None:
    """Raise BenchError for the first effect that the plane gears of the model would lack."""
    for key in effects_in(case.rig):
        if key.startswith(("rig.driver.", "rig.driven.", "rig.mesh.")):
            raise BenchError(
                f"a contact model for CalculiX has ideal flanks and sound teeth: {key} must have its neutral value"
            )


def meetings(elastic: ElasticRig, phase: float, dte: float) -> tuple[Meeting, ...]:
    """The tooth pairs that touch at a mesh phase [cycles] and DTE [m], or whose gap is below OPEN."""
    law = elastic.law
    theta1 = phase * law.driver.pitch + dte / law.driver.rb
    found = position(law, theta1, phase * law.driven.pitch, 0.0, 0.0, 0.0, 0.0, np.zeros(PAIRS))
    least = LEAST_SHARE * float(found.force.sum())
    shapes = elastic.pair.driver, elastic.pair.driven
    out = []
    for p in np.flatnonzero((found.pairs["side"] == 0) & (found.pairs["gap"] < OPEN)):
        contact, load = contact_in(found.pairs, p), float(found.force[p])
        half_width = _half_width(elastic, contact, max(load, least))
        out.append(Meeting(int(found.pairs["tooth"][p]), shapes, contact, load, half_width))
    return tuple(out)


def _half_width(elastic: ElasticRig, contact: Contact, force: float) -> float:
    """Hertz half-width [m] of a contact under a force [N]; a tip edge is as round as its arc."""
    pair = elastic.pair
    radii = [max(contact.xi1, END_SIZE), max(contact.xi2, END_SIZE)]
    if contact.slave in (EDGE1, EDGE2):
        gear = contact.slave - EDGE1
        radii[gear] = (pair.driver, pair.driven)[gear].edge_radius
    elif contact.slave in (CORNER1, CORNER2):
        radii[contact.slave - CORNER1] = END_SIZE
    relative = radii[0] * radii[1] / (radii[0] + radii[1])
    modulus = plane_moduli(elastic.rig.material).modulus / 2
    return sqrt(4 * force / pair.face_width * relative / (pi * modulus))


def _gears(elastic: ElasticRig, phase: float, met: tuple[Meeting, ...]) -> tuple[Placement, Placement]:
    """Both gears where they stand before the driver is turned by the DTE."""
    pair, rig = elastic.pair, elastic.rig
    one = _gear_mesh(pair.driver, rig.driver.hub_radius, {-m.tooth: m for m in met}, 0)
    two = _gear_mesh(pair.driven, rig.driven.hub_radius, {m.tooth: m for m in met}, 1)
    angles = (
        pair.driver_angle + phase * pair.driver.pitch_angle,
        pi + pair.driven_angle - phase * pair.driven.pitch_angle,
    )
    return (
        Placement(one, angles[0], 0.0, rig.driver.face_width),
        Placement(two, angles[1], pair.centre_distance, rig.driven.face_width),
    )


def _gear_mesh(tooth: Profile, hub_radius: float, met: dict[int, Meeting], gear: int) -> GearMesh:
    """A gear whose sectors `met` (by their number counter-clockwise from tooth 0) touch their mates."""
    z, module = tooth.teeth, tooth.module
    plain = half_boundary(tooth, hub_radius, FAR * module, FAR_GRADING)
    far = sector_within(z, plain)
    sectors = [far] * z
    beside = sector_within(z, refined_boundary(tooth, plain, NEAR * module, *_nothing(), NEAR_GRADING))
    for number in met:
        sectors[(number - 1) % z] = sectors[(number + 1) % z] = beside
    for number, meeting in met.items():
        sectors[number % z] = _touching(tooth, plain, meeting, gear)
    return assembled(sectors)


def _turn(angle: float) -> Array:
    """Matrix (2, 2) of a counter-clockwise rotation."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _nothing() -> tuple[Array, Array]:
    return np.empty((0, 2)), np.empty(0)


def _touching(tooth: Profile, plain: HalfBoundary, meeting: Meeting, gear: int) -> SectorMesh:
    """The sector of a tooth in contact: fine there, and where its own or the mate's involute ends close by."""
    own, size = meeting.arc(gear), meeting.size
    flat = FLAT * meeting.half_width + LEAST_FLAT
    arcs, sizes = [own + flat * np.linspace(-1, 1, 9)], [np.full(9, size)]
    reach = 4 * meeting.half_width + 5 * LEAST_FLAT
    for end in (meeting.own_end(gear), -meeting.own_end(1 - gear)):  # the mate's tip points to the own root
        if abs(end) < reach:
            arcs.append(own + end + LEAST_FLAT * np.linspace(-1, 1, 5))
            sizes.append(np.full(5, min(size, END_SIZE)))
    at = tooth.points(np.clip(np.concatenate(arcs), tooth.s_form, tooth.s_tip))
    boundary = refined_boundary(tooth, plain, NEAR * tooth.module, at, np.concatenate(sizes), NEAR_GRADING)
    return sector_within(tooth.teeth, boundary)


def _touch(gears: tuple[Placement, Placement], meeting: Meeting) -> Touch:
    """The surfaces of a pair: flanks around the contact; the slave is the gear that touches nearer its tip."""
    slave = int(meeting.own_end(1) < meeting.own_end(0))
    found = []
    for gear, number, wider in ((0, -meeting.tooth, slave), (1, meeting.tooth, 1 - slave)):
        mesh = gears[gear].mesh
        sides = outline_sides(mesh, number % mesh.teeth)
        middles = mesh.points[mesh.middles[sides[:, 0], sides[:, 1]]]
        # Arc lengths along the flank, from the tip's middle inwards, start at the contact.
        nearest = int(np.argmin(np.linalg.norm(middles - meeting.place(gear, number), axis=1)))
        distance = np.linalg.norm(middles - middles[nearest], axis=1)
        found.append(sides[distance < max(8 * meeting.half_width, 2e-4) * (1.3 if wider else 1.0)])
    return Touch(slave, found[slave], found[1 - slave], meeting.size)


def _head(case: Case, model: ContactModel, name: str) -> tuple[str, ...]:
    """The comment on top: what the model is, how to run it, what to compare it with."""
    one, two = PENALTIES
    t1, t2 = (1e3 * t for t in model.torques)
    dte = f"{1e6 * model.dte:.9g}"
    limit = f"{model.tolerance:g} %" + ("" if model.on_line else " (a tip edge is in contact)")
    state: str = case.rig.material.state
    if state == "plane-stress":
        state += ", computed as plane strain of an equivalent material"
    return (
        f"Contact of the gears of {name} at mesh phase {model.phase:g} and a DTE of {dte} um.",
        f"Both gears whole, exact profiles, second-order elements; {state}.",
        f"Hubs rigid; the driver is turned by DTE / base radius = {model.deck.rotation:.9g} rad, the driven gear held.",
        "Flanks without friction: surface to surface, a linear penalty of two stiffnesses, one step each. mm, N, MPa.",
        "",
        "Run:     ccx NAME (of this file, without .inp); some minutes on one core.",
        "Result:  NAME.dat, total force fx of MOMENT_DRIVER and MOMENT_DRIVEN: the moment on that gear in N mm, M1 at",
        f"         time 1, M2 at time 2. The limit of a stiff contact is M2 + (M2 - M1) / {two / one - 1:g}.",
        f"Compare: gearbench static CASE --dte-um {dte} --out static.nc, torque at mesh phase {model.phase:g}; here",
        f"         {t1:.1f} N mm at the driver and {t2:.1f} N mm at the driven gear. They agree within {limit}.",
        "",
    )
