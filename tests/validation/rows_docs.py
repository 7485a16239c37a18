"""Every code block of README and docs/ that is to be run, page by page."""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from pathlib import Path

from shared.code_blocks import blocks, pages, run_page

from gearbench.commands.house.checks import Check, Got


def failing(page: Path) -> Got:
    """Blocks of a page that fail."""
    with tempfile.TemporaryDirectory() as folder:
        failed = run_page(page, Path(folder))
    for line in failed:
        print(line, file=sys.stderr)
    return Got(len(failed), f"of {sum(block.run and block.language in ('sh', 'python') for block in blocks(page))}")


CHECKS = [
    Check(f"docs-{page.stem}", f"blocks of {page.name} that fail when run", 0.0, "blocks", partial(failing, page))
    for page in pages()
    if any(block.run and block.language in ("sh", "python") for block in blocks(page))
]
