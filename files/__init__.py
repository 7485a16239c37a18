"""Files that appear under their name only when they are complete: the one writer of all packages; and digests."""

from gearbench.files.deferred import DeferredFile
from gearbench.files.digest import digest_of, fingerprint
from gearbench.files.whole import FileError, remove_strays, write_text, write_whole

__all__ = ["DeferredFile", "FileError", "digest_of", "fingerprint", "remove_strays", "write_text", "write_whole"]
