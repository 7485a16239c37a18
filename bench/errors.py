"""The one error of this package."""


class BenchError(ValueError):
    """An experiment that cannot be carried out: one sentence that names key, value and limit."""
