"""Digests that tell one content from another."""

from __future__ import annotations

import hashlib
from pathlib import Path


def digest_of(path: Path) -> str:
    """SHA-256 (hex) of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def fingerprint(*parts: str) -> str:
    """One digest (hex) of texts that together decide a result: the case, the sources, the options."""
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
