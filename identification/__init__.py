"""Frequency-domain identification: multisines, DTE, periodically time-varying frequency responses and their truth."""

from gearbench.identification.exact import exact_frf, frozen_frf
from gearbench.identification.frf import FrfError, htf, itf, make_frf, read_frf, validate_frf, write_frf
from gearbench.identification.harmonic_balance import harmonic_balance_itf
from gearbench.identification.identify import IdentificationSettings, identify
from gearbench.identification.local_solve import LpmError
from gearbench.identification.modes import frozen_modes, itf_modes
from gearbench.identification.monodromy import exact_itf, floquet_multipliers
from gearbench.identification.multisine import MultisineError, MultisineSignal, random_phase_multisine
from gearbench.identification.periodic import (
    PeriodicSystem,
    PeriodicSystemError,
    frozen_itf,
    htf_from_itf,
    itf_from_htf,
    truncation_error,
)
from gearbench.identification.spectra import SpectraError
from gearbench.identification.transmission_error import AngleOnlyWarning, TransmissionError, dte, force

__all__ = [
    "AngleOnlyWarning",
    "FrfError",
    "IdentificationSettings",
    "LpmError",
    "MultisineError",
    "MultisineSignal",
    "PeriodicSystem",
    "PeriodicSystemError",
    "SpectraError",
    "TransmissionError",
    "dte",
    "exact_frf",
    "exact_itf",
    "floquet_multipliers",
    "force",
    "frozen_frf",
    "frozen_itf",
    "frozen_modes",
    "harmonic_balance_itf",
    "htf",
    "htf_from_itf",
    "identify",
    "itf",
    "itf_from_htf",
    "itf_modes",
    "make_frf",
    "random_phase_multisine",
    "read_frf",
    "truncation_error",
    "validate_frf",
    "write_frf",
]
