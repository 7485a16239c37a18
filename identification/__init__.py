"""Frequency-domain identification: multisines, DTE, periodically time-varying frequency responses and their truth.

`excitation`: multisines and residue combs. `spectra`: from records to spectra of force and DTE. `lpm`: the local
polynomial method. `truth`: periodic systems whose exact response is known. `response`: the dataset of a time-varying
frequency response, natural frequencies against mesh phase. `feedback`: the mesh-feedback estimator. `nonlinear`:
noise, even and odd distortion, operating response.
"""

from gearbench.identification.excitation.multisine import MultisineError, MultisineSignal, random_phase_multisine
from gearbench.identification.identify import IdentificationSettings, identify
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.nonlinear.split import DistortionError, distortion, is_coset
from gearbench.identification.response.exact import exact_frf, frozen_frf
from gearbench.identification.response.export import export_frf
from gearbench.identification.response.frf import FrfError, htf, itf, make_frf, read_frf, validate_frf, write_frf
from gearbench.identification.response.modes import frozen_modes, itf_modes
from gearbench.identification.spectra.joint import SpectraError
from gearbench.identification.spectra.transmission_error import AngleOnlyWarning, TransmissionError, dte, force
from gearbench.identification.truth.harmonic_balance import harmonic_balance_itf
from gearbench.identification.truth.monodromy import exact_itf, floquet_multipliers
from gearbench.identification.truth.periodic import (
    PeriodicSystem,
    PeriodicSystemError,
    frozen_itf,
    htf_from_itf,
    itf_from_htf,
    truncation_error,
)

__all__ = [
    "AngleOnlyWarning",
    "DistortionError",
    "FrfError",
    "IdentificationSettings",
    "LpmError",
    "MultisineError",
    "MultisineSignal",
    "PeriodicSystem",
    "PeriodicSystemError",
    "SpectraError",
    "TransmissionError",
    "distortion",
    "dte",
    "exact_frf",
    "exact_itf",
    "export_frf",
    "floquet_multipliers",
    "force",
    "frozen_frf",
    "frozen_itf",
    "frozen_modes",
    "harmonic_balance_itf",
    "htf",
    "htf_from_itf",
    "identify",
    "is_coset",
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
