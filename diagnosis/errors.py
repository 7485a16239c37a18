"""What a diagnosis cannot be made of."""


class DiagnosisError(ValueError):
    """Records, rigs or verdicts that a diagnosis cannot use; the sentence names value and limit."""
