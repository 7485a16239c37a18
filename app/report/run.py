"""The page of a run: what was found under each condition, how far to trust it, from what it was made."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearbench.report.curves import itf_map, natural_frequencies, over_phase, over_time, spectrum, stiffness_curves
from gearbench.report.html import captioned, image, table, text
from gearbench.report.live import live_page
from gearbench.report.parts import about_record, files_table, lead, limits, mark, provenance, warned
from gearbench.words.accuracy import trust
from gearbench.words.summary import findings, first_mode, warnings_of

if TYPE_CHECKING:
    from gearbench.figures.of_run import RunResults
    from gearbench.rig import Case


@dataclass(frozen=True)
class RunPart:
    """One experiment of a run. `name`: of its condition, or nothing; `pieces`: its part of the page."""

    name: str
    answer: tuple[str, ...]
    short: str
    pieces: tuple[str, ...]


def run_part(
    name: str, numbers: Mapping[str, Any], results: RunResults, picture: Callable[[str], Path],
    files: Mapping[str, tuple[str, str]],
) -> RunPart:  # fmt: skip
    """What the page says of one experiment. `picture`: the PNG file of a figure by its name; `files`: of this
    experiment, with a line about each and its SHA-256."""
    held = dict(numbers)

    def still(base: str) -> str:
        return image(picture(f"{base}.png"), base)

    def own(base: str) -> str:
        return f"{base}-{name}" if name else base

    shaded = partial(over_phase, zones=results.zones, zone_words=results.label)
    phase, static = results.static["phase"].values, results.static
    te = [("transmission error", phase, 1e6 * static["transmission_error"].values[0])]
    stiffness = stiffness_curves(static)
    modes = {**results.responses, **results.modes}
    record = results.record
    pieces = [
        natural_frequencies(own("modes"), modes, still("natural_frequency"), results.zones, results.label),
        *warned(warnings_of(held)),
        text("Frequency response over the mesh cycle", "h2"),
        itf_map(own("itf"), results.responses, still("itf")),
        text("Transmission error and stiffness", "h2"),
        shaded(
            own("te"), te, "TE [um]", still("transmission_error"),
            f"Static transmission error at {held['torque_mean_nm']:g} N m over one mesh period.",
        ),
        shaded(
            own("stiffness"), stiffness, "mesh stiffness [N/um]", still("stiffness"),
            "Mesh stiffness over one mesh period, hub to hub.", from_zero=True,
        ),
        text("The record", "h2"),
        over_time(own("time"), record, still("record")),
        spectrum(own("spectrum"), {"DTE": record}, still("spectrum"), _band(results)),
        text("What was done and found", "h2"),
        *(text(line) for line in findings(held)),
        table(("quantity", "value", "unit"), _numbers(held), numbers=(1,)),
        captioned(still("gears"), "Gear pair at mesh phase 0, and where the teeth touch."),
        text("How far to trust it", "h2"),
        *(text(line) for line in trust(held)),
        *limits(str(held["model"]), str(record.attrs.get("limits", ""))),
        text("Files beside this page", "h2"),
        files_table(files),
        table(("of the record", ""), about_record(str(record.attrs.get("provenance", ""))), code=(1,)),
    ]  # fmt: skip
    return RunPart(name, _answer(held), _short(held), tuple(pieces))


def run_page(case: Case, parts: Sequence[RunPart], versions: Sequence[tuple[str, str]]) -> str:
    """The page as one HTML text: one part, or one for each condition."""
    title = f"{case.name}: {parts[0].short}" if len(parts) == 1 else f"{case.name} under {len(parts)} conditions"
    body = [mark("run", case.name), text(title, "h1")]
    for part in parts:
        if len(parts) > 1:
            body.append(text(f"Condition {part.name}: {part.short}", "h1"))
        body += [*lead(part.answer), *part.pieces]
    return live_page(title, [*body, *provenance(versions, case)])


def _band(results: RunResults) -> float:
    """Frequency [Hz] up to which the record was identified."""
    return float(results.responses["identified"]["frequency"].max())


def _answer(numbers: dict[str, Any]) -> tuple[str, ...]:
    orders = ", ".join(f"{value:.4g}" for value in numbers["te_mesh_orders_um"])
    found = numbers["identification"]
    return (
        f"Under {numbers['torque_mean_nm']:g} N m the static transmission error is {numbers['te_peak_to_peak_um']:.4g}"
        f" um peak to peak (mesh orders 1-3: {orders} um).",
        f"First mode: {first_mode(numbers)}.",
        f"The identified response is expected to err by {found['expected_error']:.2%} of its rms"
        + (
            f"; against the exact response it errs by {numbers['itf_error_against_exact']:.2%}."
            if "itf_error_against_exact" in numbers
            else "; there is no exact response of this model to measure it against."
        ),
    )


def _short(numbers: dict[str, Any]) -> str:
    low, high = numbers["first_mode_hz"]
    mode = f", first mode {low:.0f}-{high:.0f} Hz" if low == low else ""
    return f"TE {numbers['te_peak_to_peak_um']:.3g} um peak to peak{mode}"


def _numbers(numbers: dict[str, Any]) -> list[tuple[str, str, str]]:
    stiffness = numbers["stiffness_n_per_um"]
    rows = [
        ("static TE, peak to peak", f"{numbers['te_peak_to_peak_um']:.5g}", "um"),
        *(
            (f"static TE, mesh order {n}", f"{value:.5g}", "um")
            for n, value in enumerate(numbers["te_mesh_orders_um"], 1)
        ),
        ("mesh stiffness, tangent, least", f"{stiffness[0]:.5g}", "N/um"),
        ("mesh stiffness, tangent, most", f"{stiffness[1]:.5g}", "N/um"),
        ("DTE of the record, peak to peak", f"{numbers['dte_record_peak_to_peak_um']:.5g}", "um"),
        ("mean torque", f"{numbers['torque_mean_nm']:g}", "N m"),
        ("mesh frequency", f"{numbers['mesh_frequency_hz']:g}", "Hz"),
        ("first mode, lowest", f"{numbers['first_mode_hz'][0]:.1f}", "Hz"),
        ("first mode, highest", f"{numbers['first_mode_hz'][1]:.1f}", "Hz"),
        ("first mode, damping ratio", f"{numbers['first_mode_damping']:.2g}", "1"),
        ("expected error of the ITF, of its rms", f"{100 * numbers['identification']['expected_error']:.3g}", "%"),
    ]
    return [row for row in rows if row[1] != "nan"]
