"""Pieces of a page in one HTML file: escaped text, tables, bars, pictures as SVG inside. Nothing is fetched."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

_STYLE = """
:root { color-scheme: light; }
body { margin: 0 auto; padding: 1.5rem 1.2rem 3rem; max-width: 62rem; color: #1d2126; background: #fff;
  font: 15px/1.5 "DejaVu Sans", "Segoe UI", Verdana, Helvetica, Arial, sans-serif; }
h1 { font-size: 1.65rem; line-height: 1.25; margin: .2rem 0 .4rem; }
h2 { font-size: 1.1rem; margin: 1.9rem 0 .5rem; padding-top: .6rem; border-top: 1px solid #d9dde2; }
p { margin: .4rem 0; } .lead { font-size: 1.05rem; } .small { font-size: .85rem; color: #555c64; }
.mark { font-size: .8rem; letter-spacing: .04em; color: #555c64; }
table { border-collapse: collapse; margin: .5rem 0; font-size: .9rem; }
th, td { padding: .25rem .7rem .25rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid #e6e9ed; }
th { font-weight: 600; } td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.best td { font-weight: 600; } td.code { font-family: "DejaVu Sans Mono", Consolas, monospace; font-size: .8rem;
  overflow-wrap: anywhere; } td.code:first-child { white-space: nowrap; }
.bar { display: flex; height: 1.7rem; margin: .8rem 0 .2rem; border-radius: 3px; overflow: hidden; }
.bar div { min-width: 2px; } .legend span { margin-right: 1.4rem; white-space: nowrap; }
.legend i { display: inline-block; width: .8em; height: .8em; margin-right: .4em; border-radius: 2px; }
figure { margin: .8rem 0; } figure svg { width: 100%; height: auto; } figcaption { font-size: .85rem; color: #555c64; }
summary { cursor: pointer; font-size: .85rem; color: #0b5c9e; } .wide { overflow-x: auto; }
ul { margin: .3rem 0; padding-left: 1.2rem; }
h1, h2, p, li, figcaption { overflow-wrap: anywhere; } figure img { max-width: 100%; height: auto; }
.live .plots { display: none; } .live.drawn .plots { display: block; } .live.drawn .still { display: none; }
.live .plot { width: 100%; margin-top: 1.7rem; } .live .modebar-container { top: -1.7rem !important; }
.pair { display: flex; flex-wrap: wrap; } .pair .plot { flex: 1 1 20rem; min-width: 0; }
.sliders { display: flex; flex-wrap: wrap; gap: .2rem 1.5rem; font-size: .85rem; margin: .4rem 0; }
.sliders label { flex: 1 1 20rem; }
.sliders input { width: 45%; vertical-align: middle; }
.player img { display: block; width: 100%; max-width: 840px; height: auto; }
.controls { display: flex; gap: .6rem; max-width: 840px; margin: .4rem 0; } .controls[hidden] { display: none; }
.controls input { flex: 1; min-width: 0; } .controls button { min-width: 5em; }
pre { overflow-x: auto; font: .8rem/1.4 "DejaVu Sans Mono", Consolas, monospace; background: #f5f6f8; padding: .6rem; }
.warn { border-left: 4px solid #d1600a; padding: .1rem 0 .1rem .7rem; }
@media print { body { max-width: none; font-size: 11px; } h2, figure, table { break-inside: avoid; }
  h2 { break-after: avoid; } .live.drawn .plots, .controls { display: none; } .live.drawn .still { display: block; }
  .wide { overflow-x: visible; } }
"""

# Nothing is fetched: the browser itself is told so.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data: blob:"
# By which a report is told from a page of somebody else.
GENERATOR = '<meta name="generator" content="gearbench">'


def page(title: str, body: Sequence[str]) -> str:
    """A whole page; `body` are pieces made by the functions below, `title` is plain text."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n{GENERATOR}\n'
        f"<title>{escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(piece for piece in body if piece)
        + "\n</body>\n</html>\n"
    )


def text(words: str, kind: str = "p", style: str = "") -> str:
    """A paragraph or heading of plain text."""
    mark = f' class="{style}"' if style else ""
    return f"<{kind}{mark}>{escape(words)}</{kind}>"


def preformatted(words: str) -> str:
    """Plain text line by line, in letters of one width."""
    return f"<pre>{escape(words)}</pre>"


def items(lines: Sequence[str]) -> str:
    """A list of plain sentences; nothing if there are none."""
    return "<ul>\n" + "\n".join(f"<li>{escape(line)}</li>" for line in lines) + "\n</ul>" if lines else ""


def table(
    head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = (), best: int | None = None,
    code: Sequence[int] = (),
) -> str:
    """A table of plain text; `numbers` and `code` are columns of that kind, `best` is a row in bold."""

    def kind(column: int) -> str:
        return ' class="n"' if column in numbers else ' class="code"' if column in code else ""

    top = "".join(f"<th{kind(n) if n in numbers else ''}>{escape(word)}</th>" for n, word in enumerate(head))
    bold = ' class="best"'
    lines = [
        f"<tr{bold if number == best else ''}>"
        + "".join(f"<td{kind(n)}>{escape(cell)}</td>" for n, cell in enumerate(row))
        + "</tr>"
        for number, row in enumerate(rows)
    ]
    held = "\n".join(lines)
    return f'<div class="wide"><table>\n<thead><tr>{top}</tr></thead>\n<tbody>\n{held}\n</tbody>\n</table></div>'


def folded(summary: str, body: str) -> str:
    """Something that opens on a click."""
    return f"<details><summary>{escape(summary)}</summary>\n{body}\n</details>"


def bar(parts: Sequence[tuple[str, float, str, str]]) -> str:
    """One bar of parts (name, fraction 0..1, what is written of it, colour) with its legend."""
    boxes = "".join(
        f'<div style="width:{100 * fraction:.2f}%;background:{colour}"></div>' for _, fraction, _, colour in parts
    )
    names = "".join(
        f'<span><i style="background:{colour}"></i>{escape(name)} {escape(written)}</span>'
        for name, _, written, colour in parts
    )
    label = escape(", ".join(f"{name} {written}" for name, _, written, _ in parts), quote=True)
    return f'<div class="bar" role="img" aria-label="{label}">{boxes}</div>\n<div class="legend">{names}</div>'


def picture(draw: Callable[[Path], None], name: str, caption: str) -> str:
    """A picture as inline SVG: `draw(path)` writes an SVG file; `name` keeps its ids apart from other pictures'."""
    return captioned(drawing(draw, name), caption)


def captioned(element: str, caption: str) -> str:
    """A drawing or an image as a figure with its caption."""
    return (
        f'<figure role="img" aria-label="{escape(caption, quote=True)}">{element}'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def drawing(draw: Callable[[Path], None], name: str) -> str:
    """What `draw(path)` writes as an SVG file, as an element of a page; `name` as in `picture`."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.svg"
        draw(path)
        return inline_svg(path.read_text(encoding="utf-8"), name)


def image(path: Path, words: str) -> str:
    """A PNG file as an element of a page; `words` stand for it where it cannot be seen."""
    data = b64encode(path.read_bytes()).decode("ascii")
    return f'<img alt="{escape(words, quote=True)}" src="data:image/png;base64,{data}">'


def inline_svg(document: str, name: str) -> str:
    """An SVG document as an element of a page: no prolog, no metadata, fluid size, ids of its own."""
    element = document[document.index("<svg") :]
    element = re.sub(r"<metadata>.*?</metadata>\s*", "", element, flags=re.DOTALL)
    opening, rest = element.split(">", 1)
    opening = re.sub(r'\s(width|height)="[^"]*"', "", opening)
    element = f"{opening}>{rest}"
    element = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', element)
    element = re.sub(r'\bhref="#([^"]+)"', rf'href="#{name}-\1"', element)
    element = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", element)
    # Coordinates to a hundredth of a point: half the size, and nobody sees the difference.
    return re.sub(r'\bd="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path.group()), element).strip()
