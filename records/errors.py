"""The one error of this package."""


class RecordError(ValueError):
    """A record that cannot be used: the sentence names what is wrong, where, and the limit."""
