"""The folder that a run writes into: whose it is, what is in it already, and how files get there whole."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearbench.files import digest_of, remove_strays, write_text, write_whole
from gearbench.shell.failure import InputError, say

_MARK = "run.json"


@dataclass(frozen=True)
class Output:
    """A claimed output folder. Products are written under their final name only when complete."""

    folder: Path

    def has(self, name: str) -> bool:
        """Whether an earlier run of the same case and sources left this product, and it is as it was written."""
        written = self.files().get(name)
        return written is not None and self.path(name).is_file() and digest_of(self.path(name)) == written

    def path(self, name: str) -> Path:
        """Where a product belongs."""
        return self.folder / name

    def write(self, name: str, write: Callable[[Path], object]) -> Path:
        """Let `write` fill the product `name`, which appears when it is complete. Raises FileError."""

        def write_and_note(temporary: Path) -> None:
            write(temporary)
            # Noted before the file has its name: a run that is killed in between makes the product again.
            self.note(name, temporary)

        return write_whole(self.path(name), write_and_note)

    def note(self, name: str, file: Path) -> None:
        """Take a complete `file`, which is the product `name` or is to become it, for a product."""
        self.set_mark(self.mark() | {"files": self.files() | {name: digest_of(file)}})

    def write_text(self, name: str, text: str) -> Path:
        """Write a text product."""
        return self.write(name, lambda path: path.write_text(text, encoding="utf-8"))

    def mark(self) -> dict[str, Any]:
        """What the folder says about itself: command, identity and files of the run; empty when nothing."""
        try:
            mark = json.loads(self.path(_MARK).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return mark if isinstance(mark, dict) else {}

    def files(self) -> dict[str, str]:
        """SHA-256 (hex) of every product that a run of this folder wrote, by name."""
        files = self.mark().get("files")
        return {str(Path(name).name): str(digest) for name, digest in files.items()} if isinstance(files, dict) else {}

    def set_mark(self, mark: dict[str, Any]) -> None:
        """Replace that in one step."""
        write_text(self.path(_MARK), json.dumps(mark, indent=2) + "\n")


@contextmanager
def claimed(folder: Path, command: str, identity: str, force: bool = False) -> Iterator[Output]:
    """Claim a folder for one command with that identity, and hold it until the end.

    A new or empty folder is taken. One that the same command with the same identity left is resumed. Anything
    else is refused with InputError, unless `force`: then the files that the former run wrote are removed, and
    nothing else. Two runs into one folder at the same time are refused too. An interruption says what it leaves.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {folder} is a file; it must be a folder")
    folder.mkdir(parents=True, exist_ok=True)
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise InputError(f"another run is writing into {folder}") from error
        remove_strays(folder)
        output = Output(folder)
        _take(output, command, identity, force)
        try:
            yield output
        except KeyboardInterrupt:
            if any(path.name != _MARK for path in folder.iterdir()):
                say(f"what is done is kept in {folder}: the same command goes on from there")
            raise
    finally:
        os.close(handle)


def _take(output: Output, command: str, identity: str, force: bool) -> None:
    mark = output.mark()
    if mark.get("identity") == identity and mark.get("command") == command:
        return
    if any(output.folder.iterdir()) and not force:
        what = "a run of another case, other options or other sources" if mark else "files of another origin"
        raise InputError(f"{output.folder} holds {what}: choose another --out, or add --force")
    for name in output.files():
        output.path(name).unlink(missing_ok=True)
    output.set_mark({"command": command, "identity": identity, "files": {}})
