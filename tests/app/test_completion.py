"""Completion as a shell asks for it: bash itself, with the script that the command prints."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


def gearbench(*arguments: str, **extra: str) -> str:
    """What the command prints."""
    command = [sys.executable, "-P", "-m", "gearbench", *arguments]
    done = subprocess.run(command, env=os.environ | extra, capture_output=True, text=True, check=True)
    return done.stdout


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_commands_and_cases(tmp_path: Path) -> None:
    program = tmp_path / "gearbench"
    program.write_text(f"#!/bin/sh\nexec '{sys.executable}' -P -m gearbench \"$@\"\n", encoding="utf-8")
    program.chmod(0o755)
    script = gearbench("completion", "bash")
    assert "complete -o default -F _gearbench_completion gearbench" in script
    ask = "COMP_WORDS=({words}); COMP_CWORD={last}; _gearbench_completion gearbench; echo ${{COMPREPLY[@]}}"
    typed = ("gearbench sta", "gearbench check quick_")
    lines = [ask.format(words=words, last=len(words.split()) - 1) for words in typed]
    path = f"{tmp_path}:{os.environ['PATH']}"
    command = ["bash", "-c", "\n".join([script, *lines])]
    done = subprocess.run(command, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["static", "quick_fe quick_lumped"]


@pytest.mark.parametrize(("shell", "words"), [("zsh", "#compdef gearbench"), ("fish", "complete --command gearbench")])
def test_other_shells_have_scripts(shell: str, words: str) -> None:
    assert words in gearbench("completion", shell)
