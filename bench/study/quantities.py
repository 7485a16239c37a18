"""What a study can ask of a member: single numbers, each out of one solution of the member's case.

A solution that several quantities need is made once. Every number is one column, whose name carries its unit.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Sequence
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearbench.bench.errors import BenchError
from gearbench.bench.study.against import Reference, gap
from gearbench.rig import Case

Array = NDArray[np.float64]


class Column(NamedTuple):
    """One number: name with its unit, the unit as people write it, what it is."""

    name: str
    unit: str
    words: str


class Quantity(NamedTuple):
    """Numbers that are asked for together; `find` takes them from the solution called `stage`."""

    name: str
    stage: str
    columns: tuple[Column, ...]
    find: Callable[[Any], tuple[float, ...]]


class Ask(NamedTuple):
    """What is wanted of every member: names of quantities, load of the static and ISO results [N m] (None: the
    experiment's mean), mesh phases of a cycle, mesh cycles; `loads` [N m]: every number at each of these in its place,
    as COLUMN@0, COLUMN@1, ..; `against`: the measured record that gaps are told from"""

    of: tuple[str, ...]
    torque: float | None = None
    positions: int = 64
    cycles: int = 1
    loads: tuple[float, ...] = ()
    against: Reference | None = None


def _te(result: Any) -> Array:
    return np.asarray(1e6 * result["transmission_error"].values[0])


def _orders(result: Any) -> tuple[float, ...]:
    """Amplitudes of mesh orders 1-3, also of several mesh cycles on end, where errors stand between them."""
    values = _te(result)
    cycles = int(result.attrs["mesh_cycles"])
    spectrum = 2 * np.abs(np.fft.rfft(values)) / values.size
    return tuple(float(spectrum[order * cycles]) for order in (1, 2, 3))


def _share(result: Any) -> tuple[float, ...]:
    if "load_share" not in result:
        raise BenchError(
            'load-share needs tooth pairs of their own, which simulation.model = "lumped" lacks: set simulation.model ='
            ' "reduced"'
        )
    return (float(result["load_share"].values[0].max(axis=1).mean()),)


def _stiffness(result: Any) -> Array:
    return np.asarray(1e-6 * result["stiffness_tangent"].values[0])


def _span(values: Array) -> float:
    return float(values.max() - values.min())


def _gap(record: Any) -> tuple[float, ...]:
    if record.attrs.get(_AGAINST) is None:
        raise BenchError("gap needs the measured record: campaign --against RECORD")
    return gap(record, record.attrs[_AGAINST])


def _dte(record: Any) -> Array:
    return np.asarray(1e6 * record["dte"].values)


# Attribute of a simulated record in memory: the measured one that it is held against.
_AGAINST = "held_against"
_STATIC = "static response over the mesh cycle"
_STEADY = "steady running at the experiment's speed under its mean torque"
_QUANTITIES = (
    Quantity(
        "te-peak-to-peak", "static",
        (Column("te_peak_to_peak_um", "um", "peak-to-peak static transmission error"),),
        lambda result: (_span(_te(result)),),
    ),
    Quantity(
        "te-mean", "static",
        (Column("te_mean_um", "um", "mean static transmission error"),),
        lambda result: (float(_te(result).mean()),),
    ),
    Quantity(
        "te-orders", "static",
        tuple(
            Column(f"te_order_{order}_um", "um", f"amplitude of mesh order {order} of the static transmission error")
            for order in (1, 2, 3)
        ),
        _orders,
    ),
    Quantity(
        "stiffness-mean", "static",
        (Column("stiffness_mean_n_per_um", "N/um", "mean tangent mesh stiffness"),),
        lambda result: (float(_stiffness(result).mean()),),
    ),
    Quantity(
        "stiffness-amplitude", "static",
        (Column("stiffness_amplitude_n_per_um", "N/um", "half the peak-to-peak of the tangent mesh stiffness"),),
        lambda result: (0.5 * _span(_stiffness(result)),),
    ),
    Quantity(
        "load-share", "static",
        (Column("load_share", "1", "share of the load on the tooth pair that carries most, mean over the cycle"),),
        _share,
    ),
    Quantity(
        "iso-kv", "iso",
        (Column("iso_dynamic_factor", "1", "K_v of ISO 6336-1 Method B at the experiment's speed"),),
        lambda found: (found["kv"],),
    ),
    Quantity(
        "iso-c-gamma", "iso",
        (Column("iso_c_gamma_n_per_mm_um", "N/(mm um)", "mesh stiffness c_gamma of ISO 6336-1 Method B"),),
        lambda found: (found["c_gamma"],),
    ),
    Quantity(
        "first-mode", "modes",
        (
            Column("first_mode_lowest_hz", "Hz", "lowest first natural frequency over the mesh cycle, frozen"),
            Column("first_mode_highest_hz", "Hz", "highest first natural frequency over the mesh cycle, frozen"),
        ),
        lambda values: (float(np.nanmin(values)), float(np.nanmax(values))),
    ),
    Quantity(
        "dte-rms", "record",
        (Column("dte_rms_um", "um", "rms of the simulated DTE about its mean"),),
        lambda record: (float(_dte(record).std()),),
    ),
    Quantity(
        "dte-peak-to-peak", "record",
        (Column("dte_peak_to_peak_um", "um", "peak-to-peak of the simulated DTE"),),
        lambda record: (_span(_dte(record)),),
    ),
    Quantity(
        "gap", "record",
        (
            Column("gap_um", "um", "rms difference of simulated and measured DTE, mean over mesh periods"),
            Column("gap_percent", "%", "that difference over the rms of the measured DTE"),
        ),
        _gap,
    ),
    Quantity(
        "dynamic-factor", "steady",
        (Column("dynamic_factor", "1", "largest mesh force over the static one in steady running"),),
        lambda found: (float(found["dynamic_factor"].values[0, 0]),),
    ),
    Quantity(
        "contact-loss", "steady",
        (Column("contact_loss", "1", "part of the time without contact in steady running"),),
        lambda found: (float(found["contact_loss"].values[0, 0]),),
    ),
)  # fmt: skip
QUANTITIES: dict[str, Quantity] = {one.name: one for one in _QUANTITIES}
SOLUTIONS = {
    "static": _STATIC,
    "iso": "ISO 6336-1",
    "modes": "the model linearised and frozen at each mesh phase",
    "record": "the simulated experiment",
    "steady": _STEADY,
}


def check_quantities(names: Iterable[str]) -> tuple[str, ...]:
    """The names, each once; of none, the peak-to-peak TE. Raises BenchError for one that is unknown."""
    found = tuple(dict.fromkeys(names)) or ("te-peak-to-peak",)
    for name in found:
        if name not in QUANTITIES:
            close = difflib.get_close_matches(name, QUANTITIES, n=1)
            hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(QUANTITIES)}"
            raise BenchError(f"{name!r} is not a result that a study knows: {hint}")
    return found


def columns_of(names: Iterable[str]) -> tuple[Column, ...]:
    """The columns of these quantities, in order."""
    return tuple(column for name in names for column in QUANTITIES[name].columns)


def single_column(name: str) -> tuple[str, Column]:
    """A quantity and its only column, by its own name, or one column of several by the column's. Raises BenchError."""
    for quantity in QUANTITIES.values():
        for column in quantity.columns:
            if column.name == name:
                return quantity.name, column
    (found,) = check_quantities([name])
    columns = QUANTITIES[found].columns
    if len(columns) > 1:
        raise BenchError(f"{name} is several numbers: name one of {', '.join(column.name for column in columns)}")
    return found, columns[0]


def measure(case: Case, ask: Ask) -> tuple[dict[str, float], list[str]]:
    """The numbers of a case by their columns, and warnings. Raises what the solvers raise."""
    if ask.loads:
        pairs = [(name, one.name) for name in ask.of for one in columns_of([name])]
        rows = {column: at_loads(case, ask.loads, name, column, ask) for name, column in pairs}
        return {f"{column}@{n}": float(value) for column, row in rows.items() for n, value in enumerate(row)}, []
    solved: dict[str, Any] = {}
    numbers: dict[str, float] = {}
    for name in ask.of:
        quantity = QUANTITIES[name]
        if quantity.stage not in solved:
            solved[quantity.stage] = _STAGES[quantity.stage](case, ask)
        found = quantity.find(solved[quantity.stage])
        numbers |= {column.name: value for column, value in zip(quantity.columns, found, strict=True)}
    said = [str(one.attrs.get("warnings") or "") for one in solved.values() if hasattr(one, "attrs")]
    lines = [line for text in said for line in text.splitlines() if line]
    return numbers, list(dict.fromkeys(lines))


def at_loads(case: Case, torques: Sequence[float], name: str, column: str, ask: Ask) -> Array:
    """One column of a quantity (loads,) at driver torques [N m]; static results are solved for all of them at once."""
    quantity = QUANTITIES[name]
    if quantity.stage != "static":
        asks = [ask._replace(of=(name,), torque=torque, loads=()) for torque in torques]
        return np.array([measure(loaded(case, one.torque), one)[0][column] for one in asks])
    from gearbench.bench.statics import static

    result = static(case, torque=tuple(torques), positions=ask.positions, cycles=ask.cycles)
    place = [one.name for one in quantity.columns].index(column)
    parts = (result.isel(load=[load]).assign_attrs(mesh_cycles=ask.cycles) for load in range(len(torques)))
    return np.array([quantity.find(part)[place] for part in parts])


def loaded(case: Case, torque: float | None) -> Case:
    """The case with that mean torque, where one is given."""
    if torque is None:
        return case
    experiment = case.experiment.model_copy(update={"torque_mean": torque})
    return case.model_copy(update={"experiment": experiment})


def _static(case: Case, ask: Ask) -> Any:
    from gearbench.bench.statics import static

    torque = (ask.torque,) if ask.torque is not None else ()
    result = static(case, torque=torque, positions=ask.positions, cycles=ask.cycles)
    return result.assign_attrs(mesh_cycles=ask.cycles)


def _iso(case: Case, ask: Ask) -> dict[str, float]:
    from gearbench.bench.refusals.gears import check_gears
    from gearbench.bench.refusals.stated import check_stated
    from gearbench.bench.sweep import iso_factors
    from gearbench.geometry import pair
    from gearbench.lumped.stiffness.iso6336 import iso_stiffness

    check_gears(case.rig)
    under_load = loaded(case, ask.torque)
    meshing = pair(case.rig)
    found: dict[str, float] = {}
    if "iso-c-gamma" in ask.of:
        if ask.torque is None:
            check_stated(case, "iso-c-gamma")
        force = under_load.experiment.torque_mean / meshing.driver.base_radius
        found["c_gamma"] = iso_stiffness(case.rig, meshing, force).mesh
    if "iso-kv" in ask.of:
        check_stated(case, "iso-kv")
        found["kv"] = float(iso_factors(under_load, np.array([_speed(case)]))[0][0])
    return found


def _speed(case: Case) -> float:
    """Speed of the driver [rad/s]."""
    teeth = case.rig.driver.teeth
    return case.experiment.mesh_frequency_for(teeth) * 2 * pi / teeth


def _modes(case: Case, ask: Ask) -> Array:
    from gearbench.bench.models import model_for
    from gearbench.bench.refusals.gears import check_gears
    from gearbench.bench.refusals.stated import check_stated

    check_stated(case, "first-mode")
    check_gears(case.rig)
    if model_for(case)[1].elastic:
        from gearbench.bench.results.responses import linearised_modes

        values = np.asarray(linearised_modes(case, ask.positions)["natural_frequency"].values[0])
    else:
        from gearbench.bench.results.exact import lumped_periodic_system
        from gearbench.identification.response.modes import frozen_modes

        phase = np.arange(ask.positions) / ask.positions
        values = frozen_modes(lumped_periodic_system(case), phase, modes=1)[0][0]
    if not np.isfinite(values).any():
        raise BenchError("first-mode: no mode of this rig oscillates at any mesh phase")
    return values


def _record(case: Case, ask: Ask) -> Any:
    from gearbench.bench.experiment import simulate
    from gearbench.bench.refusals.stated import check_stated

    check_stated(case, "a simulated record")
    return simulate(case).assign_attrs({_AGAINST: ask.against})


def _steady(case: Case, ask: Ask) -> Any:
    from gearbench.bench.refusals.stated import check_stated
    from gearbench.bench.sweep import sweep

    check_stated(case, "steady running")
    return sweep(case, [_speed(case)])


_STAGES: dict[str, Callable[[Case, Ask], Any]] = {
    "static": _static,
    "iso": _iso,
    "modes": _modes,
    "record": _record,
    "steady": _steady,
}
