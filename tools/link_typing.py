"""Renews `tools/typing/gearbench`: links in which mypy and pyright find the namespace as it is installed.

Run it after adding a module or a package to `app/`, or a package on top: `python tools/link_typing.py`.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TREE = ROOT / "tools" / "typing" / "gearbench"


def wanted() -> dict[str, Path]:
    """Name of each link and what it points to: everything importable in `app/`, and every other package."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    links = {}
    for package, folder in settings["package-dir"].items():
        if package == "gearbench":
            links.update({path.name: path for path in (ROOT / folder).glob("*.py")})
            links.update({path.parent.name: path.parent for path in (ROOT / folder).glob("*/__init__.py")})
        else:
            links[package.removeprefix("gearbench.")] = ROOT / folder
    return links


def renew() -> None:
    """Make the tree hold exactly the wanted links."""
    TREE.mkdir(parents=True, exist_ok=True)
    links = wanted()
    for path in TREE.iterdir():
        if path.is_symlink() and (path.name not in links or path.resolve() != links[path.name]):
            path.unlink()
    for name, target in links.items():
        if not (TREE / name).is_symlink():
            (TREE / name).symlink_to(Path("../../..") / target.relative_to(ROOT))


if __name__ == "__main__":
    renew()
