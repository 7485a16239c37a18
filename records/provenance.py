"""Where a result comes from: version, digest of the sources, case, seed and settings, as JSON."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

# Packages whose sources decide a result; those that are not installed are skipped.
SOURCE_PACKAGES = (
    "gearbench",
    *(
        f"gearbench.{name}"
        for name in (
            "rig",
            "records",
            "files",
            "kernels",
            "geometry",
            "fem",
            "lumped",
            "identification",
            "bench",
            "diagnosis",
            "challenge",
        )
    ),
)


def package_version() -> str:
    """Version of the installed distribution."""
    try:
        return version("gearbench")
    except PackageNotFoundError:
        return "unknown"


@lru_cache(maxsize=1)
def source_digest() -> str:
    """SHA-256 (hex) over names and contents of every Python source file of the installed packages."""
    digest = hashlib.sha256()
    for package in SOURCE_PACKAGES:
        spec = find_spec(package)
        for folder in (spec.submodule_search_locations or []) if spec else []:
            for source in sorted(Path(folder).rglob("*.py")):
                digest.update(f"{package}/{source.name}\0".encode())
                digest.update(source.read_bytes())
                digest.update(b"\0")
    return digest.hexdigest()


def provenance(case_text: str, seed: int | None, settings: Mapping[str, Any], *, release: str | None = None) -> str:
    """JSON text for the attribute `provenance`: version, digest of sources, case, seed, settings.

    `settings` holds what was chosen at run time (sub-steps, solver, limits); it must be JSON-serialisable.
    `release` overrides the version of the installed distribution.
    """
    content = {
        "version": release or package_version(),
        "sources": source_digest(),
        "case": case_text,
        "seed": seed,
        "settings": dict(settings),
    }
    return json.dumps(content, sort_keys=True, allow_nan=False)
