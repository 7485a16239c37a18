"""Lengths in sentences, in the unit that an engineer reads them in."""

from __future__ import annotations


def length_words(metres: float) -> str:
    """A length [m] of four digits: in um below a millimetre, in mm below a metre, else in m.

    >>> length_words(3.2e-5), length_words(0.03226), length_words(13.89)
    ('32 um', '32.26 mm', '13.89 m')
    """
    for unit, scale in (("um", 1e6), ("mm", 1e3)):
        if abs(metres) * scale < 999.95:
            return f"{scale * metres:.4g} {unit}"
    return f"{metres:.4g} m"
