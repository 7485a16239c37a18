"""Which effect that the simulation leaves out causes its gap to the measurement."""

from gearbench.diagnosis.diagnosis import Diagnosis, diagnose
from gearbench.diagnosis.errors import DiagnosisError

__all__ = ["Diagnosis", "DiagnosisError", "diagnose"]
