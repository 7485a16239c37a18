"""Residue combs: excite only the lines +-r modulo the lines of one mesh order, and every kind of answer has its own.

With `modulus` M lines to the mesh frequency (an excitation period of M teeth, a multiple of lcm(z1, z2)), the lines
of an answer tell what made it, modulo M: the operating response of identical teeth falls on 0, the linear
periodically time-varying response to the lines +-r on +-r, even distortion on +-2r and 0, odd distortion on +-3r and
+-r (sums of two and of three excited lines), and what differs from tooth to tooth puts sidebands k M/z1 or k M/z2
apart around each of these. Where two of them coincide, the record cannot tell them apart; a good r lets few coincide.
Combs that leave lines empty for distortion: Pintelon and Schoukens, System Identification, 2012, section 4.3.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

HARMONICS = 3  # of each shaft that are kept apart
MOST_CANDIDATES = 2000

# What multiples 0, 1, 2, 3 of r carry: label, words, and how strongly it is expected to answer.
_CARRIERS = (
    ("operating", "operating response", 1.0),
    ("excited", "linear response", 1.0),
    ("even", "even distortion", 0.3),
    ("odd", "odd distortion", 0.05),
)
OTHER = "other"
_SIDEBAND = 0.3  # expected strength of each further sideband
_ORDINAL = ("", "1st", "2nd", "3rd")


class CombError(ValueError):
    """A comb that cannot be made; the sentence names the value and the limit."""


@dataclass(frozen=True)
class Overlap:
    """Two kinds of answer on the same lines: the weaker `first` falls on the stronger `second`.

    `lines` are these lines modulo the modulus, folded into 0 .. modulus/2; `strength` is the product of both
    expected strengths (1 for operating on linear response); `inherent` holds for every residue.
    """

    first: str
    second: str
    lines: tuple[int, ...]
    strength: float
    inherent: bool

    def __str__(self) -> str:
        return f"{self.first} falls on the {self.second}" + (", whatever the residue" if self.inherent else "")


@dataclass(frozen=True)
class _Kind:
    """One kind of answer: around `multiple` r, `harmonic` times `spacing` lines apart (0: on it)."""

    multiple: int
    shaft: str = ""
    harmonic: int = 0
    spacing: int = 0

    @property
    def words(self) -> str:
        carrier = _CARRIERS[self.multiple][1]
        return f"{_ORDINAL[self.harmonic]} {self.shaft} sideband of the {carrier}" if self.shaft else carrier

    @property
    def label(self) -> str:
        carrier = _CARRIERS[self.multiple][0]
        if not self.shaft:
            return carrier
        return f"{self.shaft}-{carrier}" if self.multiple else self.shaft

    @property
    def strength(self) -> float:
        return _CARRIERS[self.multiple][2] * float(_SIDEBAND**self.harmonic)

    @property
    def offsets(self) -> tuple[int, ...]:
        """Lines from the carrier; those of the operating response (carrier 0) are the same on both sides."""
        apart = self.harmonic * self.spacing
        return (apart, -apart) if apart and self.multiple else (apart,)


def fold(lines: int | Ints, modulus: int) -> Ints:
    """Lines modulo `modulus`, -l taken for l: 0 .. modulus/2."""
    low = np.mod(lines, modulus)
    return np.asarray(np.minimum(low, modulus - low))


def hunting_teeth(teeth_driver: int, teeth_driven: int) -> int:
    """Teeth after which every pairing returns: lcm(z1, z2)."""
    return teeth_driver * teeth_driven // gcd(teeth_driver, teeth_driven)


def ranked_residues(modulus: int, teeth_driver: int, teeth_driven: int) -> Ints:
    """Residues (R,) from the best down, all of them with {0, +-r, +-2r, +-3r} disjoint modulo `modulus`.

    Order: least summed strength of the overlaps with shaft sidebands (1-3, around each class); of equals the
    one with the widest gap between the classes, then the smallest. At most 2000 candidates are looked at,
    around modulus/7, where the classes are evenly spread. CombError where no residue keeps the classes apart
    (modulus below 6) or where the modulus is no multiple of both numbers of teeth.
    """
    kinds = _kinds(modulus, teeth_driver, teeth_driven)
    first = max(1, round(modulus / 7) - MOST_CANDIDATES // 2)
    candidates = np.arange(first, min((modulus - 1) // 2, first + MOST_CANDIDATES - 1) + 1)
    classes = np.sort(fold(np.multiply.outer(candidates, np.arange(4)), modulus), axis=1)
    gap = np.diff(classes, axis=1).min(axis=1, initial=modulus)
    candidates, gap = candidates[gap > 0], gap[gap > 0]
    if not candidates.size:
        raise CombError(f"a comb modulo {modulus} has no residue that keeps 0, r, 2r and 3r apart; 6 is the least")
    entries = [(kind, offset) for kind in kinds for offset in kind.offsets]
    lines = np.stack([fold(kind.multiple * candidates + offset, modulus) for kind, offset in entries])
    cost = np.zeros(candidates.size)
    for i, (kind, _) in enumerate(entries):
        for j in range(i + 1, len(entries)):
            if entries[j][0] != kind:
                cost += kind.strength * entries[j][0].strength * (lines[i] == lines[j])
    # Rounding must not decide between equals.
    return candidates[np.lexsort((candidates, -gap, np.round(cost, 9)))]


def overlaps(modulus: int, teeth_driver: int, teeth_driven: int, residue: int) -> tuple[Overlap, ...]:
    """All pairs of kinds of answer that share lines with this residue, the strongest first. Raises CombError.

    That even distortion also falls on the operating response and odd distortion on the linear one is in the
    nature of every comb and not listed. What coincides around every class alike is listed for the operating
    response only, as inherent.
    """
    check_residue(modulus, residue)
    kinds = _kinds(modulus, teeth_driver, teeth_driven)
    found = [_equal_teeth(modulus, teeth_driver)] if teeth_driver == teeth_driven else []
    for i, one in enumerate(kinds):
        for two in kinds[i + 1 :]:
            shared = sorted(_lines(one, residue, modulus) & _lines(two, residue, modulus))
            inherent = one.multiple == two.multiple and _always(one, two, modulus)
            if shared and not (inherent and one.multiple):
                weak, strong = sorted((one, two), key=lambda kind: kind.strength)
                strength = weak.strength * strong.strength
                found.append(Overlap(weak.words, strong.words, tuple(shared), strength, inherent))
    return tuple(sorted(found, key=lambda overlap: (-overlap.strength, overlap.first, overlap.second)))


def residue_class(
    lines: Ints, modulus: int, residue: int | None, teeth_driver: int, teeth_driven: int
) -> NDArray[np.str_]:
    """Label of every line (same shape; signed lines count like positive ones): what kind of answer it carries.

    "operating", "excited", "even", "odd"; "driver-shaft", "driven-shaft" (sidebands 1-3 of the operating
    response) and "driver-shaft-excited", "driven-shaft-excited" (of the linear response); "both-shafts" and
    "both-shafts-excited" instead where the gears have equal teeth; "other". Of several kinds on one line the
    strongest counts: carriers before sidebands, lower before higher, operating before excited. residue None:
    no comb, so only the operating response and its sidebands are told from the rest. Raises CombError.
    """
    if residue is not None:
        check_residue(modulus, residue)
    table = np.full(modulus // 2 + 1, OTHER, dtype="U24")
    kinds = [kind for kind in _kinds(modulus, teeth_driver, teeth_driven) if not kind.shaft or kind.multiple < 2]
    if residue is None:
        kinds = [kind for kind in kinds if not kind.multiple]
    for kind in sorted(kinds, key=lambda kind: (-kind.harmonic, -kind.multiple, kind.shaft)):
        table[list(_lines(kind, residue or 0, modulus))] = kind.label
    return np.asarray(table[fold(np.asarray(lines), modulus)])


def residue_of(lines: Ints, modulus: int) -> int | None:
    """The residue of which all excited `lines` are, modulo `modulus`; None when they are no comb."""
    found = np.unique(fold(np.asarray(lines), modulus))
    return int(found[0]) if found.size == 1 and 0 < 2 * int(found[0]) < modulus else None


def check_residue(modulus: int, residue: int) -> None:
    """Raise CombError unless 0 < residue < modulus/2."""
    if not 0 < 2 * residue < modulus:
        limit = (modulus - 1) // 2
        raise CombError(f"residue = {residue} must lie between 1 and {limit}, below half of {modulus} lines")


def _kinds(modulus: int, teeth_driver: int, teeth_driven: int) -> tuple[_Kind, ...]:
    teeth = hunting_teeth(teeth_driver, teeth_driven)
    if modulus < 1 or modulus % teeth:
        raise CombError(f"modulus = {modulus} must be a multiple of lcm({teeth_driver}, {teeth_driven}) = {teeth}")
    shafts = {"driver-shaft": modulus // teeth_driver, "driven-shaft": modulus // teeth_driven}
    if teeth_driver == teeth_driven:
        shafts = {"both-shafts": modulus // teeth_driver}
    return tuple(_around_carriers(shafts))


def _around_carriers(shafts: dict[str, int]) -> Iterator[_Kind]:
    for multiple in range(len(_CARRIERS)):
        yield _Kind(multiple)
        for shaft, spacing in shafts.items():
            for harmonic in range(1, HARMONICS + 1):
                yield _Kind(multiple, shaft, harmonic, spacing)


def _equal_teeth(modulus: int, teeth: int) -> Overlap:
    lines = tuple(sorted({int(fold(k * modulus // teeth, modulus)) for k in range(1, HARMONICS + 1)}))
    second = "driver-shaft sideband of equal number"
    return Overlap("every driven-shaft sideband", second, lines, _SIDEBAND**2, True)


def _lines(kind: _Kind, residue: int, modulus: int) -> set[int]:
    return {int(fold(kind.multiple * residue + offset, modulus)) for offset in kind.offsets}


def _always(one: _Kind, two: _Kind, modulus: int) -> bool:
    """Whether two kinds around the same class coincide for every residue."""
    offsets = {offset % modulus for offset in (*one.offsets, *(-o for o in one.offsets))}
    return any(offset % modulus in offsets for offset in two.offsets)
