"""What a page asks of the world, and what a browser makes of it."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
WIDTHS = (400, 1280)

# Put into a copy of a page: tells the page around it what went wrong and how far it reaches beyond its width.
_WITNESS = """<script>
const wrong = [];
addEventListener("error", (event) => wrong.push(String(event.message)));
addEventListener("unhandledrejection", (event) => wrong.push(String(event.reason)));
addEventListener("securitypolicyviolation", (event) => wrong.push("request: " + event.blockedURI));
const said = console.error;
console.error = (...words) => { wrong.push(words.join(" ")); said(...words); };
addEventListener("load", () => setTimeout(() => parent.postMessage({
  wrong, beyond: document.documentElement.scrollWidth - innerWidth, drawn: document.querySelectorAll(".drawn").length,
  figures: document.querySelectorAll("figure.live").length, plots: document.querySelectorAll(".main-svg").length,
}, "*"), 1500));
</script>"""
_FRAME = """<!DOCTYPE html><script>
const heard = {};
addEventListener("message", (event) => {
  for (const frame of document.querySelectorAll("iframe"))
    if (frame.contentWindow === event.source) heard[frame.name] = event.data;
  document.documentElement.dataset.heard = JSON.stringify(heard);
});
</script>"""


class Addresses(HTMLParser):
    """Every address that a page names in an attribute, and every element."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.elements: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what a browser would fetch."""
        self.elements.append(tag)
        self.found += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href", "srcset", "data")]


def elements(page: str) -> list[str]:
    """Names of all elements of a page."""
    parser = Addresses()
    parser.feed(page)
    return parser.elements


def fetched(page: str) -> list[str]:
    """Addresses outside of a page that a browser would go to."""
    parser = Addresses()
    parser.feed(page)
    return [address for address in parser.found if not address.startswith(("data:", "#"))]


def browsed(pages: Sequence[Path], folder: Path) -> dict[str, Any]:
    """What Chromium makes of pages at both widths: "NAME WIDTH" -> wrong, beyond, drawn, figures, plots."""
    assert CHROMIUM is not None
    frames = []
    for number, page in enumerate(pages):
        copy = folder / f"witnessed{number}.html"
        copy.write_text(page.read_text(encoding="utf-8").replace("<head>", f"<head>{_WITNESS}", 1), encoding="utf-8")
        frames += [
            f'<iframe name="{page.stem} {width}" src="{copy.name}" style="width:{width}px;height:900px"></iframe>'
            for width in WIDTHS
        ]
    around = folder / "around.html"
    around.write_text(_FRAME + "".join(frames), encoding="utf-8")
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}",
        "--virtual-time-budget=30000", "--window-size=1400,1000", "--dump-dom", around.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    found = re.search(r'data-heard="([^"]*)"', done.stdout)
    heard: dict[str, Any] = json.loads(html.unescape(found.group(1))) if found else {}
    return heard
