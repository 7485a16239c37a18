"""Pages: every command and script in them is one that works; the quick ones are run here, all by the row `docs`."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
import typer.main
from shared import code_blocks as runner
from shared.code_blocks import LANGUAGES, ROOT, Block, blocks, pages, run_page

from gearbench.cli import _LISTS, application
from gearbench.shell.options import expand_lists

QUICK = ("how-to/swap-a-gear",)
BLOCKS = [block for page in pages() for block in blocks(page)]


def options_of(words: list[str]) -> dict[str, Any]:
    """What the command line understands of these words; raises where it does not."""
    command: Any = typer.main.get_command(application())
    context = command.make_context("gearbench", expand_lists(words, _LISTS))
    while hasattr(command, "resolve_command"):
        name, command, rest = command.resolve_command(context, [*context._protected_args, *context.args])
        context = command.make_context(name, rest, parent=context)
    return dict(context.params)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.place)
def test_block_is_what_it_says(block: Block) -> None:
    assert block.language in LANGUAGES
    if block.language == "python":
        compile(block.text, block.place, "exec")
    if block.language == "toml":
        tomllib.loads(block.text)
    if block.language == "sh":
        assert block.commands or "gearbench" not in block.text
        for words in block.commands:
            assert words[0] == "test" or options_of(words) is not None


@pytest.mark.parametrize("words", [["chek", "quick_fe"], ["check", "quick_fe", "--nonsense"], ["static"]])
def test_command_that_there_is_not_is_seen(words: list[str]) -> None:
    with pytest.raises(Exception, match=r"No such|Missing"):
        options_of(words)


@pytest.mark.parametrize("name", QUICK)
def test_quick_page_runs(name: str, tmp_path: Path) -> None:
    assert run_page(ROOT / "docs" / f"{name}.md", tmp_path) == []


def test_what_fails_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pages").mkdir()
    (tmp_path / "page").mkdir()
    page = tmp_path / "pages" / "page.md"
    page.write_text(
        "```sh\n./gearbench --version   # fine\n./gearbench check \\\n    none.toml\n```\n\n"
        "```python\nraise SystemExit('no')\n```\n\n"
        "<!-- not run: it would fail -->\n\n    ./gearbench check none.toml\n\n"
        '```toml title="a.toml"\nx = 1\n```\n\n```matlab\nfail()\n```\n\n    a formula\n',
        encoding="utf-8",
    )
    monkeypatch.setattr(runner, "ROOT", tmp_path)
    failed = run_page(page, tmp_path / "page")
    assert [one.split(": ")[0] for one in failed] == ["pages/page.md:1", "pages/page.md:7"]
    assert "none.toml" in failed[0] and failed[1].endswith("no")
    assert (tmp_path / "page" / "a.toml").read_text(encoding="utf-8") == "x = 1\n"
    assert [block.language for block in blocks(page)] == ["sh", "python", "sh", "toml", "matlab", "text"]


def test_variables_of_a_page_hold_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pages").mkdir()
    (tmp_path / "page").mkdir()
    page = tmp_path / "pages" / "page.md"
    text = '    A="no such"\n    ./gearbench check $A.toml\n\nWords.\n\n    ./gearbench check $A\n'
    page.write_text(text, encoding="utf-8")
    monkeypatch.setattr(runner, "ROOT", tmp_path)
    first, second = blocks(page)
    assert (first.language, second.commands) == ("sh", [["check", "$A"]])
    variables: dict[str, str] = {}
    assert first.commands_with(variables) == [["check", "no", "such.toml"]]
    assert second.commands_with(variables) == [["check", "no", "such"]]
    assert len(run_page(page, tmp_path / "page")) == 2
