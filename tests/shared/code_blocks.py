"""Code blocks of Markdown pages, and the running of them, page by page, each page in a folder of its own.

Fenced blocks say what they are: `sh` holds gearbench commands and variables (R="text"), which hold to the end of the
page, `python` a script, `toml title="mine.toml"` what is put at the end of that file; any other language is not run. An
indented block is `sh` if a line of it is a command. The comment `<!-- not run: REASON -->` above a block keeps it from
running.
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
VARIABLE = re.compile(r"(\w+)=(\"[^\"]*\"|\S+)")
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
        return self.commands_with({})

    def commands_with(self, variables: dict[str, str]) -> list[list[str]]:
        """The same with variables in place, to which those that the block sets are added."""
        found = []
        for line in self.text.replace("\\\n", " ").splitlines():
            set_here = VARIABLE.fullmatch(line.strip())
            if set_here:
                variables[set_here[1]] = shlex.split(set_here[2])[0]
            elif COMMAND.match(line):
                known = re.sub(r"\$(\w+)", lambda name: variables.get(name[1], name[0]), line)
                found.append(shlex.split(known, comments=True)[1:])
        return found


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
    if any(COMMAND.match(line) for line in text.splitlines()):
        return "sh"
    return "python" if text.startswith("import gearbench") else "text"


def run_page(page: Path, folder: Path) -> list[str]:
    """Run the blocks of a page in order in an empty folder, beside links to cases and tests; what failed, and how."""
    for name in ("cases", "tests"):
        (folder / name).symlink_to(ROOT / name)
    failed = []
    variables: dict[str, str] = {}
    for block in blocks(page):
        if block.title and block.language == "toml":
            with (folder / block.title).open("a", encoding="utf-8") as file:
                file.write(block.text + "\n")
        elif block.run and block.language == "python":
            failed += _failure(block, ["-c", block.text], folder)
        elif block.run and block.language == "sh":
            for words in block.commands_with(variables):
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
