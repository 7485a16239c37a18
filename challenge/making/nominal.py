"""The nominal rig as a challenge hands it out: its case without a word about effects that it does not have."""

from __future__ import annotations

import tempfile
from pathlib import Path

from gearbench.rig import Case, dump_case, read_case


def nominal_text(nominal: Case) -> str:
    """A case text equal to `nominal`, left without every table and key that it does not need."""
    nominal = nominal.model_copy(update={"assumed": ()})
    blocks = [block for block in dump_case(nominal).split("\n\n") if block.strip()]
    kept = list(blocks)
    for block in blocks:
        rest = [other for other in kept if other is not block]
        if _reads_as(rest, nominal):
            kept = rest
    lines = [block.split("\n") for block in kept]
    for block_lines in lines:
        for line in [line for line in block_lines if "=" in line]:
            place = block_lines.index(line)
            del block_lines[place]
            if not _reads_as(["\n".join(block) for block in lines], nominal):
                block_lines.insert(place, line)
    return "\n\n".join("\n".join(block).strip("\n") for block in lines) + "\n"


def _reads_as(blocks: list[str], nominal: Case) -> bool:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "nominal.toml"
        path.write_text("\n\n".join(blocks) + "\n", encoding="utf-8")
        try:
            return read_case(path) == nominal
        except ValueError:
            return False
