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
"""Code blocks of Markdown pages, and the running of them, page by page, each page in a folder of its own.

Fenced blocks say what they are: `sh` holds gearbench commands, `python` a script, `toml title="mine.toml"` what is put
at the end of that file; any other language is not run. Indented blocks are known by their first word. The comment
`<!-- not run: REASON -->` above a block keeps it from running.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = {"sh", "python", "toml", "matlab", "text"}
COMMAND = re.compile(r"(\./)?gearbench\s")
# Commands of these run what runs them, or for hours.
ELSEWHERE = {"test", "validate"}


@dataclass(frozen=True)
class Block:
    """One code block: where it begins, its language, its text, the file that it belongs to, whether it is to be run."""

    page: Path
    line: int
    language: str
    text: str
    title: str | None = None
    run: bool = True

    @property
    def place(self) -> str:
        """Page and line."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    @property
    def commands(self) -> list[list[str]]:
        """Words of each gearbench command of a shell block, without the program's name."""
        lines = self.text.replace("\\\n", " ").splitlines()
        return [shlex.split(line, comments=True)[1:] for line in lines if COMMAND.match(line)]


def pages() -> list[Path]:
    """README and every page of docs/."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(page: Path) -> list[Block]:
    """Every code block of a page, in order."""
    return list(_blocks(page, page.read_text(encoding="utf-8").splitlines()))


def _blocks(page: Path, lines: list[str]) -> Iterator[Block]:
    at = 0
    while at < len(lines):
        fence = re.fullmatch(r"```(\S*)(.*)", lines[at])
        if fence:
            end = next(i for i in range(at + 1, len(lines)) if lines[i] == "```")
            title = re.search(r'title="([^"]+)"', fence[2])
            text = "\n".join(lines[at + 1 : end])
            yield Block(page, at + 1, fence[1], text, title[1] if title else None, _wanted(lines, at))
            at = end + 1
        elif lines[at].startswith("    ") and (at == 0 or not lines[at - 1].strip()) and not _in_list(lines, at):
            after = (i for i in range(at, len(lines)) if lines[i].strip() and not lines[i].startswith("    "))
            end = next(after, len(lines))
            text = "\n".join(line[4:] for line in lines[at:end])
            yield Block(page, at + 1, _guessed(text), text, None, _wanted(lines, at))
            at = end
        else:
            at += 1


def _wanted(lines: list[str], at: int) -> bool:
    before = [line for line in lines[:at] if line.strip()]
    return not (before and before[-1].startswith("<!-- not run: "))


def _in_list(lines: list[str], at: int) -> bool:
    """Whether the paragraph before is an item of a list, which indented lines go on."""
    before = [line for line in lines[:at] if line.strip()]
    return bool(before) and bool(re.match(r"\s*([-*]|\d+\.)\s", before[-1]) or before[-1].startswith("  "))


def _guessed(text: str) -> str:
    if COMMAND.match(text):
        return "sh"
    return "python" if text.startswith("import gearbench") else "text"


def run_page(page: Path, folder: Path) -> list[str]:
    """Run the blocks of a page in order in an empty folder, beside links to cases and tests; what failed, and how."""
    for name in ("cases", "tests"):
        (folder / name).symlink_to(ROOT / name)
    failed = []
    for block in blocks(page):
        if block.title and block.language == "toml":
            with (folder / block.title).open("a", encoding="utf-8") as file:
                file.write(block.text + "\n")
        elif block.run and block.language == "python":
            failed += _failure(block, ["-c", block.text], folder)
        elif block.run and block.language == "sh":
            for words in block.commands:
                if words[0] not in ELSEWHERE:
                    failed += _failure(block, ["-m", "gearbench", *words], folder)
    return failed


def _failure(block: Block, words: list[str], folder: Path) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-P", *words], cwd=folder, env=os.environ, capture_output=True, text=True, check=False
    )
    if done.returncode == 0:
        return []
    said = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
    return [f"{block.place}: {' '.join(words)[:120]}: {' '.join(said)}"]
