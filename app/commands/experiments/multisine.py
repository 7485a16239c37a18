"""`multisine CASE`: what the excitation of a case will resolve, before anything is measured."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from gearbench.shell.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.shell.progress import Progress
from gearbench.words.accuracy import limit_and_advice

if TYPE_CHECKING:
    from gearbench.bench.design import Design, Numbers
    from gearbench.identification import IdentificationSettings
    from gearbench.rig import Case

# Part of the error with prescribed numbers below which the free choice is no gain worth the name.
GAIN = 0.8


def multisine(
    case: CaseArgument,
    snr_db: Annotated[
        float, typer.Option("--snr-db", help="torque-induced DTE over noise, rms in the excited band")
    ] = 40.0,
    method: Annotated[
        Literal["lpm", "mesh-feedback"] | None,
        typer.Option("--method", help="estimator, which chooses L, R, n; absent: the case's, with those of the case"),
    ] = None,
    band_hz: Annotated[
        tuple[float, float] | None, typer.Option("--band-hz", help="identified band; absent: the case's, else excited")
    ] = None,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Tell what the planned multisine of a case will resolve: branches, record length, expected error of the response.

    The spectra of the planned record are written down from the exact response of the linearised lumped model, with
    noise, and identified as the record would be, with the branches L, order R and window n that the case prescribes.
    """
    loaded = load_case(case, settings)
    from gearbench.bench.design import design

    with Progress(f"multisine {loaded.name}") as progress:
        progress.step("plan")
        found = design(
            loaded,
            planned_settings(loaded, method, band_hz),
            snr_db=snr_db,
            progress=progress,
        )
    if as_json:
        print_json({**asdict(found), "realisations_needed": found.realisations_needed, "advice": advice(found)})
        return
    typer.echo("\n".join(sentences(found)))
    for sentence in advice(found):
        typer.echo(f"advice: {sentence}")


def planned_settings(
    case: Case, method: Literal["lpm", "mesh-feedback"] | None, band: tuple[float, float] | None
) -> IdentificationSettings:
    """The settings with which `run` identifies the case's record, in another band or by another method if asked for;
    what the case prescribes belongs to its own method."""
    from gearbench.bench.results.responses import identification_settings

    own = identification_settings(case.identification)
    if method is not None and method != own.method:
        own = replace(own, method=method, harmonics=None, order=None, window=None)
    return replace(own, band=band or own.band, modes=0)


def sentences(found: Design) -> list[str]:
    """The plan, the mode that it is meant for, and what comes out."""
    return [
        f"excitation: {found.lines} lines {found.spacing:g} Hz apart in {found.band[0]:g}-{found.band[1]:g} Hz,"
        f" {found.peak:.4g} N m peak, {found.rms:.4g} N m rms, crest {found.crest:.3g};"
        f" {found.realisations} realisation(s), {found.distinct:g} s of distinct excitation",
        f"mesh: {found.mesh_frequency:g} Hz; first mode {found.natural[0]:.4g}-{found.natural[1]:.4g} Hz with"
        f" {found.bandwidth:.3g} Hz of bandwidth: {found.branches} branches a side, {found.needed:.3g} s of distinct"
        " excitation",
        f"at {found.snr_db:g} dB, {found.identified[0]:g}-{found.identified[1]:g} Hz:"
        f" {found.method} ({_in_words(found.window)}) would err by {100 * found.actual:.2g}%, and expect of itself"
        f" {100 * found.expected:.2g}%",
        *_of_prescribed(found),
    ]


def _in_words(numbers: Numbers) -> str:
    """L, R and n, as far as there are any."""
    given = zip("LRn", numbers, strict=True)
    return ", ".join(f"{name} = {value}" for name, value in given if value is not None)


def _of_prescribed(found: Design) -> list[str]:
    """Whether the prescribed L, R, n are enough, and if not, what is amiss."""
    given = _in_words(found.prescribed)
    if not given:
        return []
    if found.refusal:
        return [f"prescribed {given}: not possible, and left to choose above; {found.refusal}"]
    size = f"{found.account['unknowns']} unknowns from {found.account['equations']} equations"
    if found.enough:
        return [f"prescribed {given}: enough, {size}"]
    cause, _ = limit_and_advice(found.account)
    if found.free is None:
        return [f"prescribed {given}: {size}; what limits is {cause}; nothing else fits the record"]
    free = f"{found.free.method} ({_in_words(found.free.window)}) would err by {100 * found.free.actual:.2g}%"
    if found.free.actual < GAIN * found.actual:
        return [f"prescribed {given}: not enough, {size}; what limits is {cause}; left to choose, {free}"]
    return [f"prescribed {given}: as good as the record allows, {size}; what limits is {cause}; left to choose, {free}"]


def advice(found: Design) -> list[str]:
    """What to change."""
    notes: list[str] = []
    if found.needed > found.distinct:
        notes.append(
            f"the record is short by a factor of {found.needed / found.distinct:.3g}: set"
            f" experiment.realisations={found.realisations_needed}, or longer periods, or use --method mesh-feedback"
        )
    if found.headroom < 1.0:
        notes.append(
            f"the multisine would unload the mesh: at most {found.headroom:.2g} of it,"
            f" {found.headroom * found.peak:.3g} N m peak, or more mean torque"
        )
    if found.natural[1] + found.bandwidth > found.band[1] or found.natural[0] - found.bandwidth < found.band[0]:
        notes.append(
            f"the band leaves out {_left_out(found)} the first mode: excite"
            f" {max(found.natural[0] - 2 * found.bandwidth, 0.0):.0f}-"
            f"{found.natural[1] + 2 * found.bandwidth:.0f} Hz at least"
        )
    if found.spacing > found.bandwidth / 4:
        notes.append(
            f"lines {found.spacing:g} Hz apart are too few for a bandwidth of {found.bandwidth:.3g} Hz:"
            f" take periods of {4 / found.bandwidth:.2g} s or more"
        )
    return notes


def _left_out(found: Design) -> str:
    """How much of the first mode's range the band leaves out."""
    inside = found.natural[0] <= found.band[1] and found.natural[1] >= found.band[0]
    return "part of" if inside else "all of"
