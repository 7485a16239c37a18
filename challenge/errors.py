"""The one error of this package."""


class ChallengeError(ValueError):
    """Bad input to a challenge: one sentence that names what is wrong, its value and the limit."""
