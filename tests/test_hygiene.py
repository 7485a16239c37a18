"""What is kept in the repository holds on every machine."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("work", "root", "home", "tmp")
MACHINE_PATH = re.compile(rf"(?<![\w.~}}$)*-])/(?:{'|'.join(FOLDERS)})(?:/|\b(?!\.))")
# Written so that the pattern does not find itself.
REGISTRY = re.compile(r"pypi[.]org|python[h]osted|--(?:extra-)?index[-]url|--find[-]links", re.IGNORECASE)
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
