"""Words for units, as measuring programs write them: what they measure, and their size in SI."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from math import pi

from gearbench.records.errors import RecordError

_G = 9.80665  # standard gravity [m/s^2]
_DEG = pi / 180
_LBF = 4.4482216152605
_FT_LBF, _IN_LBF, _IN_OZF = 0.3048 * _LBF, 0.0254 * _LBF, 0.0254 * _LBF / 16


@dataclass(frozen=True)
class Unit:
    """A unit: value in SI = factor x (number + zero)."""

    word: str
    quantity: str
    factor: float
    zero: float = 0.0


# Quantity -> its SI unit first, then others with their size in it. Case counts (Nm and nm, mN and MN).
_WORDS: dict[str, dict[str, float]] = {
    "time": {
        "s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "usec": 1e-6,
        "ns": 1e-9, "min": 60.0, "h": 3600.0,
    },
    "angle": {
        "rad": 1.0, "radian": 1.0, "radians": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": _DEG, "degree": _DEG,
        "degrees": _DEG, "Grad": _DEG, "mdeg": 1e-3 * _DEG, "arcmin": _DEG / 60, "arcsec": _DEG / 3600,
        "rev": 2 * pi, "revs": 2 * pi, "turn": 2 * pi, "turns": 2 * pi, "Umdr": 2 * pi, "U": 2 * pi,
    },
    "angular speed": {
        "rad/s": 1.0, "deg/s": _DEG, "rpm": pi / 30, "RPM": pi / 30, "rev/min": pi / 30, "1/min": pi / 30,
        "r/min": pi / 30, "U/min": pi / 30, "min^-1": pi / 30, "rev/s": 2 * pi, "rps": 2 * pi,
    },
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": _DEG},
    "length": {
        "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "micron": 1e-6, "nm": 1e-9, "in": 0.0254, "inch": 0.0254,
        "inches": 0.0254, "mil": 2.54e-5, "mils": 2.54e-5, "uin": 2.54e-8, "microinch": 2.54e-8,
    },
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "in/s": 0.0254},
    "acceleration": {
        "m/s^2": 1.0, "mm/s^2": 1e-3, "um/s^2": 1e-6, "g": _G, "gn": _G, "mg": 1e-3 * _G, "in/s^2": 0.0254,
    },
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "MN": 1e6, "lbf": _LBF, "kgf": _G},
    "torque": {
        "N m": 1.0, "kN m": 1e3, "mN m": 1e-3, "N mm": 1e-3, "N cm": 1e-2, "cN m": 1e-2,
        "daN m": 10.0, "MN m": 1e6, "kgf m": _G,
        "lbf ft": _FT_LBF, "ft lbf": _FT_LBF, "lb ft": _FT_LBF, "ft lb": _FT_LBF, "ft lbs": _FT_LBF,
        "lbf in": _IN_LBF, "in lbf": _IN_LBF, "lb in": _IN_LBF, "in lb": _IN_LBF, "in lbs": _IN_LBF,
        "ozf in": _IN_OZF, "in ozf": _IN_OZF, "oz in": _IN_OZF, "in oz": _IN_OZF,
    },
    "temperature": {"K": 1.0, "degC": 1.0, "C": 1.0, "degF": 5 / 9},
    "mesh cycles": {"cycles": 1.0},
    "count": {"pulses": 1.0, "pulse": 1.0, "counts": 1.0, "count": 1.0, "ticks": 1.0, "Impulse": 1.0},
    "quadrature count": {"quadrature counts": 1.0},
    "pulse time": {"pulse times s": 1.0, "pulse times ms": 1e-3, "pulse times us": 1e-6, "pulse times ns": 1e-9},
    "level": {"quadrature levels": 1.0, "V": 1.0, "TTL": 1.0},
    "number": {"1": 1.0},
}  # fmt: skip
# A pound is a mass as well: it is a force only where a force is asked for.
_POUND = "lb"
_ZEROS = {"degC": 273.15, "C": 273.15, "degF": 459.67}
# What writers use instead of a word's letters, in the order of replacement.
_SPELLINGS = (
    ("\u00b5", "u"), ("\u03bc", "u"), ("\u00c2", ""), ("\u00b0", "deg"), ("\u00ba", "deg"),
    ("\u207b\u00b2", "^-2"), ("\u00b2", "^2"), ("**", "^"),
    ("\u22c5", " "), ("\u00b7", " "), ("*", " "), ("\u00b9", "1"), ("\u207b", "^-"),
)  # fmt: skip
_PER_SECOND = re.compile(r"/ *sec(?:onds?)?(?![a-z])", re.IGNORECASE)
# Words that mean the same in any case: no prefix and no symbol of one letter is among them.
_WHOLE_WORDS = (
    "sec second seconds min rad radian radians deg degree degrees arcmin arcsec rev revs turn turns rpm rps inch inches"
    " mil mils micron microinch lbf lb lbft lbfft ftlb ftlbf ftlbs lbin lbfin inlb inlbf inlbs ozin ozfin inoz inozf"
    " pulse pulses count counts ticks cycles"
)
_ANY_CASE = frozenset(_WHOLE_WORDS.split())
_PREFIXES = frozenset("acdfghkmnptu")


def _key(word: str) -> str:
    """A word without what writers do differently: blanks, dots and hyphens between factors."""
    for old, new in _SPELLINGS:
        word = word.replace(old, new)
    word = word.strip().strip("[]()").replace("s2", "s^2").replace("s^-2", "/s^2").replace("s^-1", "/s")
    word = _PER_SECOND.sub("/s", word).replace("s2", "s^2").replace("/s/s", "/s^2")
    word = word.replace("//", "/").replace("min^-1", "1/min").replace("min-1", "1/min")
    return word.replace(" ", "").replace(".", "").replace("-", "").replace("_", "")


_UNITS = {
    _key(word): Unit(word, quantity, factor, _ZEROS.get(word, 0.0))
    for quantity, words in _WORDS.items()
    for word, factor in words.items()
}


def is_unit(word: str, quantity: str = "") -> bool:
    """Whether the word is a known unit (of the quantity that a channel has, where it is known)."""
    return _found(word, quantity) is not None


def unit_of(word: str, where: str, quantity: str = "") -> Unit:
    """The unit that a word means, of whatever quantity; `quantity`: that of the channel, where it is known.

    Raises RecordError for an unknown one: `where` begins the sentence, which names units of the channel's quantity.
    """
    found = _found(word, quantity)
    if found is not None:
        return found
    words = list(_WORDS[quantity]) if quantity else [known for words in _WORDS.values() for known in words]
    near = difflib.get_close_matches(_key(word), [_key(known) for known in words], n=1, cutoff=0.6) if quantity else []
    if near and not _prefixed(_key(word), near[0]):
        hint = f"; did you mean {_UNITS[near[0]].word!r}?"
    else:
        hint = f"; units{f' of {quantity}' if quantity else ''} are {', '.join(words)}"
    raise RecordError(f"{where} has the unit {word!r}, which is not known{hint}")


def _found(word: str, quantity: str) -> Unit | None:
    """The unit of a word as it is written, or in lower case where case means nothing."""
    key = _key(word)
    if key not in _UNITS:
        key = "/".join(part.lower() if part.lower() in _ANY_CASE else part for part in key.split("/"))
    if key == _POUND and quantity == "force":
        return Unit(word, "force", _LBF)
    return _UNITS.get(key)


def _prefixed(word: str, other: str) -> bool:
    """Whether keys differ by nothing but letters that SI prefixes are made of: such a hint could be wrong by 1000."""
    changes = difflib.SequenceMatcher(None, word, other, autojunk=False).get_opcodes()
    changed = "".join(word[a:b] + other[c:d] for kind, a, b, c, d in changes if kind != "equal")
    return set(changed.lower()) <= _PREFIXES


def si_word(quantity: str) -> str:
    """The SI unit of a quantity."""
    return next(iter(_WORDS[quantity]))
