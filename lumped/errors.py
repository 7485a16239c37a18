"""The one error of this package."""


class LumpedError(ValueError):
    """Input the lumped model cannot use: one sentence that names key, value and limit."""
