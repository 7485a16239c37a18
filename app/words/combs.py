"""What `check` says about residue combs: the residue of each condition and the overlaps that remain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearbench.identification.excitation.comb import Overlap
    from gearbench.rig import Case

# Overlaps of less expected strength are counted, not spelt out.
WEAK = 0.002


@dataclass(frozen=True)
class CombReport:
    """One comb and the conditions that use it; `overlaps` of each residue, the strongest first."""

    conditions: tuple[str, ...]
    modulus: int
    residues: tuple[int, ...]
    overlaps: tuple[tuple[Overlap, ...], ...]


def comb_reports(cases: Sequence[tuple[str, Case]]) -> tuple[CombReport, ...]:
    """A report for every comb among cases under one condition each (name "" where there are no conditions).

    Raises BenchError where a comb does not fit its excitation period.
    """
    from gearbench.bench.plan.excitation import comb_for
    from gearbench.identification.excitation.comb import overlaps

    used: dict[tuple[int, tuple[int, ...]], list[str]] = {}
    for name, case in cases:
        comb = comb_for(case.experiment, case.rig)
        if comb is not None:
            used.setdefault((comb.modulus, comb.residues), []).append(name)
    if not used:
        return ()
    rig = cases[0][1].rig
    teeth = rig.driver.teeth, rig.driven.teeth
    return tuple(
        CombReport(tuple(names), modulus, residues, tuple(overlaps(modulus, *teeth, residue) for residue in residues))
        for (modulus, residues), names in used.items()
    )


def comb_lines(report: CombReport) -> list[str]:
    """Lines of text for a person."""
    modulus, first = report.modulus, report.residues[0]
    names = f" ({', '.join(report.conditions)})" if any(report.conditions) else ""
    lines = [
        f"comb{names}: {modulus} lines to the mesh frequency, residue {first}:"
        f" lines {first} and {modulus - first} of each {modulus} are excited"
    ]
    strong = [overlap for overlap in report.overlaps[0] if overlap.strength >= WEAK]
    lines += [f"  {overlap}" for overlap in strong]
    weaker = len(report.overlaps[0]) - len(strong)
    if not report.overlaps[0]:
        lines.append("  nothing overlaps: every kind of response has lines of its own")
    elif weaker:
        lines.append(f"  and {weaker} weaker overlap{'s' if weaker > 1 else ''} of sidebands")
    if len(report.residues) > 1:
        rest = zip(report.residues[1:], report.overlaps[1:], strict=True)
        further = ", ".join(f"{residue} ({len(found)})" for residue, found in rest)
        lines.append(f"  further realisations take the residues (overlaps) {further}")
    return lines


def comb_data(report: CombReport) -> dict[str, Any]:
    """The same for JSON, all overlaps of all residues."""
    return {
        "conditions": [name for name in report.conditions if name],
        "modulus": report.modulus,
        "residues": list(report.residues),
        "overlaps": [
            {
                "residue": residue,
                "sentence": str(overlap),
                "lines": list(overlap.lines),
                "strength": overlap.strength,
                "inherent": overlap.inherent,
            }
            for residue, found in zip(report.residues, report.overlaps, strict=True)
            for overlap in found
        ],
    }
