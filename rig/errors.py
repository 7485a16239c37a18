"""The one error of this package."""


class CaseError(ValueError):
    """Bad input in a case: one sentence that names key, value and limit."""
