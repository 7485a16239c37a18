"""How far an identified response goes, in words: what limits it, and what helps."""

from __future__ import annotations

from math import degrees
from typing import Any

ENOUGH = 0.02  # expected rms error of the ITF above which pictures carry a warning


def honest_warning(numbers: dict[str, Any]) -> str:
    """Some sentences for the pictures where the ITF is expected to err or its record is short, else nothing."""
    found = numbers["identification"]
    duration = found.get("record_duration", numbers["realisations"] * found["joint_period"])
    needed = found.get("record_needed", 0.0)
    expected = found["expected_error"]
    if needed <= duration and expected <= ENOUGH:
        return ""
    given = f"Its {numbers['realisations']} realisation(s) give {duration:g} s of distinct excitation"
    if needed > duration:
        given += f" where about {needed:.3g} s are needed"
    if expected <= ENOUGH:
        return (
            f"The record is short. {given}. The ITF is expected to err by {expected:.1%} rms all the same, more at the"
            " switches; nothing is smoothed or masked."
        )
    cause, advice = limit_and_advice(found)
    return (
        f"Expected error of this ITF: {expected:.0%} rms, several times that at the switches. What limits it is"
        f" {cause}; {advice}. {given}; nothing is smoothed or masked."
    )


def limit_and_advice(found: dict[str, Any]) -> tuple[str, str]:
    """What limits an identified response, by the largest part of its expected error, and what helps against it."""
    if found.get("record_error", 0.0) >= 0.7 * found["expected_error"]:
        return "doubtful channels", "see the warnings of the record"
    if found.get("method") == "mesh-feedback":
        return _of_feedback(found)
    missing = found.get("truncation_error", 0.0)
    limit = found.get("limited_by", "noise" if found.get("variance_error", 0.0) > missing else "branches")
    part = found.get({"branches": "branches_error", "window": "window_error"}.get(limit, "noise_error"))
    size = f" ({part:.1%})" if part is not None else ""
    branches, wanted = found["harmonics"], found.get("harmonics_needed", 0)
    if limit == "noise":
        return f"noise{size}", "more periods or realisations, or a stronger multisine, bring it down"
    if limit == "branches":
        asked = f", of {wanted} that the first mode's travel asks for" if wanted > branches else ""
        smear = f", and switches are smeared over {1 / (2 * branches):.2g} mesh periods" if branches else ""
        apart = found.get("noise_error", 1.0) > 0 or found.get("periods_averaged", 2) > 1
        noise = "" if apart else ", or noise, which a single period does not tell from them"
        return (
            f"missing branches{size}{noise}: it has {branches} a side{asked}{smear}",
            "more realisations or longer periods carry more of them, and mesh feedback needs none",
        )
    if "smooth_bandwidth" in found:
        return (
            f"too few equations{size} for {branches} branches a side of a bandwidth of"
            f" {found['smooth_bandwidth']:.3g} Hz",
            "more realisations or longer periods bring more of them, and mesh feedback needs none",
        )
    return f"the width of its windows{size}, in which {_window(found)} do not follow the response", (
        "more realisations or longer periods allow narrower ones, and mesh feedback needs none"
    )


def _window(found: dict[str, Any]) -> str:
    if not {"order", "window", "joint_period"} <= found.keys():
        return "polynomials"
    wide = (2 * found["window"] + 1) / found["joint_period"]
    beside = f" beside a bandwidth of {found['bandwidth']:.3g} Hz" if "bandwidth" in found else ""
    return f"polynomials of order {found['order']} over {wide:.3g} Hz{beside}"


def _of_feedback(found: dict[str, Any]) -> tuple[str, str]:
    apart = found.get("unexplained_error", 0.0)
    if apart >= 0.7 * found["expected_error"]:
        return (
            f"that a varying mesh force alone does not explain the record ({apart:.1%} is left)",
            "the local polynomial method does not suppose it, and asks for a longer record",
        )
    if found.get("truncation_error", 0.0) >= 0.7 * found["expected_error"]:
        return f"the {found['harmonics']} branches a side that it has room for", "ask for fewer lines"
    return (
        f"noise ({found['variance_error']:.1%})",
        "more periods or realisations, or a stronger multisine, bring it down",
    )


def trust(numbers: dict[str, Any]) -> list[str]:
    """How far to trust the identified response, in plain paragraphs."""
    found = numbers["identification"]
    lines = [*(_feedback_fit(found) if found.get("method") == "mesh-feedback" else _polynomial_fit(found))]
    if "itf_error_against_exact" in numbers:
        lines.append(
            f"Measured against the exact ITF the identified one errs by {numbers['itf_error_against_exact']:.2%};"
            f" the frozen one differs from the exact by {numbers['frozen_against_exact']:.1%} and is no reference."
        )
    else:
        lines.append("This model has no exact response to measure against: the error is an estimate.")
    return lines


def _polynomial_fit(found: dict[str, Any]) -> list[str]:
    parts = f" (variance {found['variance_error']:.2%}, missing response {found['truncation_error']:.2%})"
    if "limited_by" in found:
        parts = (
            f" (noise {found['noise_error']:.2%}, branches that it lacks {found['branches_error']:.2%}, polynomials"
            f" that do not follow {found['window_error']:.2%})"
        )
    if "smooth_bandwidth" in found:
        return [
            f"Local method with {found['harmonics']} smooth branches on each side of a bandwidth of"
            f" {found['smooth_bandwidth']:.3g} Hz: {found['unknowns']} unknowns determined by {found['equations']}"
            f" equations in each of {found['windows']} windows.",
            f"Expected error of the ITF: {found['expected_error']:.2%} of its rms (noise {found['noise_error']:.2%},"
            f" branches that it lacks {found['branches_error']:.2%}, left open for lack of equations"
            f" {found['window_error']:.2%}); at most {found['expected_error_bound']:.2%} if the whole residual is"
            " missing response.",
        ]
    return [
        f"Local polynomial method with {found['harmonics']} branches on each side, order {found['order']} and"
        f" {2 * found['window'] + 1} lines a window: {found['unknowns']} unknowns from {found['equations']} equations"
        f" in each of {found['windows']} windows; condition number {found['condition_number']:.3g}.",
        f"Expected error of the ITF: {found['expected_error']:.2%} of its rms{parts}; at most"
        f" {found['expected_error_bound']:.2%} if the whole residual is missing response.",
    ]


def _feedback_fit(found: dict[str, Any]) -> list[str]:
    return [
        f"Mesh feedback with {_basis(found)}: {found['unknowns']} unknowns from {found['equations']} equations.",
        f"Expected error of the ITF: {found['expected_error']:.2%} of its rms (variance {found['variance_error']:.2%},"
        f" not explained by a varying mesh force {found['unexplained_error']:.2%}).",
    ]


def _basis(found: dict[str, Any]) -> str:
    """What the mesh's stiffness and damping were told by."""
    if found.get("mesh_basis") != "zones":
        return f"{found['mesh_harmonics']} harmonics of the mesh"
    first, second = found["switch_phases"]
    angles = found.get("switch_angles_driver")
    turn = f" ({degrees(angles[0]):.3g} and {degrees(angles[1]):.3g} degrees of the driver)" if angles else ""
    return (
        f"zones of phase and a remainder of harmonics: switches at {first:.4g} and {second:.4g} of the mesh cycle"
        f"{turn}, {found['switch_width']:.2g} wide, {found['switch_cubics']} cubic(s) across each, which gain"
        f" {found['evidence_gain']:.0f} in twice the logarithm of the evidence over harmonics; the record determines"
        f" {found['mesh_determined']:.0f} numbers of the mesh"
    )
