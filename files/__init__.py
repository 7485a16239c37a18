"""Files that appear under their name only when they are complete: the one writer of all packages; digests; names that
are imported from their files on use.
"""

from gearbench.files.deferred import DeferredFile
from gearbench.files.digest import digest_of, fingerprint
from gearbench.files.on_use import names_on_use
from gearbench.files.whole import FileError, remove_strays, write_text, write_whole

__all__ = [
    "DeferredFile",
    "FileError",
    "digest_of",
    "fingerprint",
    "names_on_use",
    "remove_strays",
    "write_text",
    "write_whole",
]
