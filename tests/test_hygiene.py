"""What is kept in the repository holds on every machine."""

from __future__ import annotations

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("work", "root", "home", "tmp")
MACHINE_PATH = re.compile(rf"(?<![\w.~}}$)*-])/(?:{'|'.join(FOLDERS)})(?:/|\b(?!\.))")
# Written so that the pattern does not find itself.
REGISTRY = re.compile(r"pypi[.]org|python[h]osted|--(?:extra-)?index[-]url|--find[-]links", re.IGNORECASE)
# A page, and the heading of it that is meant: docs/page.md, "Heading".
PAGE = re.compile(r'docs/(\w+)\.md(?:, "([^"]+)")?')
# A page that is not in the repository, or a number instead of a heading.
ELSEWHERE = re.compile(
    r"\b(?:physics|identification|diagnosis|DESIGN),? (?:sections? )?\d|\bDESIGN\b|see (?:physics|DESIGN)\b"
)
HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)
ANCHOR = re.compile(r"\]\(([\w./-]*\.md)#([\w-]+)\)")
LINK = re.compile(r"\]\((?!https?:|#|mailto:)([^)#\s]+)")


def kept_files() -> list[Path]:
    """Files of the repository; without git, those of the checkout that are not made by using it."""
    try:
        listing = subprocess.check_output(["git", "ls-files", "-z"], cwd=ROOT, stderr=subprocess.DEVNULL)
        names = [name for name in listing.decode().split("\0") if name]
    except (OSError, subprocess.CalledProcessError):
        folders = {marker.parent.name for marker in ROOT.glob("*/__init__.py")}
        folders |= {".ci", "tests", "benchmarks", "docs"}
        paths = [*ROOT.iterdir(), *(path for folder in folders for path in (ROOT / folder).rglob("*"))]
        names = [path.relative_to(ROOT).as_posix() for path in paths if "__pycache__" not in path.parts]
    return [ROOT / name for name in names if (ROOT / name).is_file() and not (ROOT / name).is_symlink()]


@cache
def texts() -> dict[str, str]:
    """Text of every kept file; what is not UTF-8 (pictures, records) is left out."""
    found = {}
    for path in kept_files():
        try:
            found[path.relative_to(ROOT).as_posix()] = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
    return found


def matches(pattern: re.Pattern[str]) -> list[str]:
    """Lines of kept text files in which the pattern occurs."""
    return [
        f"{name}:{number}: {line.strip()}"
        for name, text in texts().items()
        for number, line in enumerate(text.splitlines(), 1)
        if pattern.search(line)
    ]


def test_files_are_found() -> None:
    assert {"gearbench", "pyproject.toml", "README.md", "rig/gear.py"} <= set(texts())


def test_no_absolute_path_of_a_machine() -> None:
    assert matches(MACHINE_PATH) == []


def test_no_address_of_a_package_registry() -> None:
    assert matches(REGISTRY) == []


@pytest.mark.parametrize("text", ["open('{}x')", "see {}x/y", "file://{}me", "{}x", "A={}x"])
def test_machine_paths_are_recognised(text: str) -> None:
    for folder in FOLDERS:
        assert MACHINE_PATH.search(text.format(f"/{folder}/"))


@pytest.mark.parametrize("text", ["force/work", "../home/x", "$HOME/tmp/x", "N/root", "{out}/tmp/x"])
def test_other_paths_are_left_alone(text: str) -> None:
    assert not MACHINE_PATH.search(text)


def test_links_between_documents_lead_somewhere() -> None:
    broken = [
        f"{name}: {target}"
        for name, text in texts().items()
        if name.endswith(".md")
        for target in LINK.findall(text)
        if not (ROOT / name).parent.joinpath(target).exists()
    ]
    assert broken == []


def headings(page: Path) -> list[str]:
    return HEADING.findall(page.read_text(encoding="utf-8"))


def unwrapped(text: str) -> str:
    """Source text whose comments and docstrings run on over the ends of lines."""
    return re.sub(r"\s*\n\s*(?:# )?", " ", text)


def misled(name: str, text: str) -> list[str]:
    """References of a source file to pages or headings that do not exist."""
    bad = [f"{name}: {found.group()}" for found in ELSEWHERE.finditer(unwrapped(text))]
    for page, heading in PAGE.findall(unwrapped(text)):
        path = ROOT / "docs" / f"{page}.md"
        if not path.is_file() or (heading and heading not in headings(path)):
            bad.append(f'{name}: docs/{page}.md, "{heading}"')
    return bad


def test_pages_and_headings_that_sources_name_exist() -> None:
    sources = {name: text for name, text in texts().items() if name.endswith(".py") and name != "tests/test_hygiene.py"}
    named = [reference for text in sources.values() for reference in PAGE.findall(unwrapped(text))]
    assert any(heading for _, heading in named)
    assert [bad for name, text in sources.items() for bad in misled(name, text)] == []


@pytest.mark.parametrize(
    "text",
    [
        "signs: physics, section 1",
        "(physics 4)",
        "see DESIGN",
        "docs/none.md",
        'docs/physics.md, "Magnets"',
        '# as in docs/physics.md,\n# "Magnets"',
    ],
)
def test_a_reference_that_leads_nowhere_is_seen(text: str) -> None:
    assert len(misled("x.py", text)) == 1


def test_references_are_followed_over_the_end_of_a_line() -> None:
    assert misled("x.py", 'signs as in docs/physics.md, "Axes, signs,\n    zeros"') == []


def test_anchors_between_documents_are_headings() -> None:
    for name, text in texts().items():
        for target, anchor in ANCHOR.findall(text) if name.endswith(".md") else ():
            kept = headings((ROOT / name).parent / target)
            assert anchor in {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in kept}, target
