"""Whether a folder may hold machine code that is going to be run: only where nobody else can put another there."""

from __future__ import annotations

import os
import stat
from functools import lru_cache
from pathlib import Path


class CacheError(ValueError):
    """A cache folder that others can write to; the sentence names it and what to do."""


@lru_cache
def trusted(folder: Path) -> Path:
    """`folder`, made where absent (for its owner alone), if only this user and who could change this program anyway
    can write there: root, the owner of the program, the members of the folder's group.

    The group counts as invited: it writes where somebody has allowed it, and on many systems every user has one of his
    own. A sticky folder that all may write to may hold the cache but not be it; below a folder that only its
    owner and group may enter all is safe. Raises CacheError. What cannot be made or looked at passes: nothing is read
    from there.
    """
    try:
        for missing in [path for path in (*reversed(folder.parents), folder) if not path.exists()]:
            missing.mkdir(mode=0o700, exist_ok=True)
        place = folder.resolve()
        about = place.stat()
        above = [(parent, parent.stat().st_mode) for parent in place.parents]
    except OSError:
        return folder
    if about.st_uid not in {os.geteuid(), 0, os.stat(__file__).st_uid}:
        raise CacheError(f"cache folder {folder} belongs to another user, who could put code there: {_REMEDY}")
    if not all(mode & stat.S_IXOTH for _, mode in above):
        return folder
    if about.st_mode & stat.S_IWOTH:
        raise CacheError(f"cache folder {folder} is writable by all, who could put code there: {_REMEDY}")
    for parent, mode in above:
        if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
            raise CacheError(f"cache folder {folder} lies in {parent}, which is writable by all: {_REMEDY}")
    return folder


_REMEDY = "chmod o-w it, or set GEARBENCH_CACHE to a folder of your own"
