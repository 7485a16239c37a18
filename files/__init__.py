"""Files that appear under their name only when they are complete: the one writer of all packages."""

from gearbench.files.whole import FileError, write_text, write_whole

__all__ = ["FileError", "write_text", "write_whole"]
