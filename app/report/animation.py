"""The page of an animation: the pictures in it, and what plays them."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

from gearbench.report.html import page, text
from gearbench.report.parts import lead, limits, mark, provenance, versions

if TYPE_CHECKING:
    from gearbench.rig import Case

PACES = (2, 4, 8, 12, 24)  # pictures a second


def animation_page(
    case: Case, title: str, sentences: Sequence[str], pictures: Sequence[tuple[str, bytes]], rate: float
) -> str:
    """The page as one HTML text. `pictures`: media type and data of each; `rate`: pictures a second at first."""
    addresses = [f"data:{kind};base64,{b64encode(data).decode('ascii')}" for kind, data in pictures]
    script = (files("gearbench.report") / "player.js").read_text(encoding="utf-8")
    body = [
        mark("animate", case.name),
        text(title, "h1"),
        *lead(sentences),
        _player(addresses, title, rate),
        text("How far to trust it", "h2"),
        text(
            "Every picture is a static solution under the torque that the mesh carries there; bodies are drawn"
            " undeformed. Colours end at the largest stress half a module and more away from the contacts, whose own is"
            " several times that."
        ),
        *limits("reduced"),
        *provenance(versions(), case),
        f"<script>\n{script}</script>",
    ]
    return page(title, body)


def _player(addresses: Sequence[str], title: str, rate: float) -> str:
    chosen = min(PACES, key=lambda pace: abs(pace - rate))
    paces = "".join(
        f'<option value="{pace}"{" selected" if pace == chosen else ""}>{pace} pictures/s</option>' for pace in PACES
    )
    held = json.dumps(addresses).replace("</", "<\\/")
    return (
        f'<figure class="player"><img alt="{escape(title, quote=True)}" src="{addresses[0]}">\n'
        '<div class="controls" hidden><button type="button">Pause</button>'
        f'<input type="range" min="0" value="0" aria-label="picture"><select aria-label="pace">{paces}</select></div>\n'
        f'<script type="application/json">{held}</script>\n</figure>'
    )
