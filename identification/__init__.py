"""Frequency-domain identification: multisines, DTE, periodically time-varying frequency responses and their truth.

`excitation`: multisines and residue combs. `spectra`: from records to spectra of force and DTE. `lpm`: the local
polynomial method. `smooth`: the local method with smooth random branches, for short records. `truth`: periodic systems
whose exact response is known. `response`: the dataset of a time-varying frequency response, natural frequencies against
mesh phase. `feedback`: the mesh-feedback estimator. `nonlinear`: noise, even and odd distortion, operating response.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearbench.files import names_on_use

if TYPE_CHECKING:
    from gearbench.identification.estimation import identify
    from gearbench.identification.excitation.multisine import MultisineError, MultisineSignal, random_phase_multisine
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

_HOMES = {
    "export_frf": "gearbench.identification.response.export",
    "DistortionError": "gearbench.identification.nonlinear.split",
    "distortion": "gearbench.identification.nonlinear.split",
    "is_coset": "gearbench.identification.nonlinear.split",
    "AngleOnlyWarning": "gearbench.identification.spectra.transmission_error",
    "FrfError": "gearbench.identification.response.frf",
    "IdentificationSettings": "gearbench.identification.task",
    "LpmError": "gearbench.identification.lpm.local_solve",
    "MultisineError": "gearbench.identification.excitation.multisine",
    "MultisineSignal": "gearbench.identification.excitation.multisine",
    "PeriodicSystem": "gearbench.identification.truth.periodic",
    "PeriodicSystemError": "gearbench.identification.truth.periodic",
    "SpectraError": "gearbench.identification.spectra.joint",
    "TransmissionError": "gearbench.identification.spectra.transmission_error",
    "dte": "gearbench.identification.spectra.transmission_error",
    "exact_frf": "gearbench.identification.response.exact",
    "exact_itf": "gearbench.identification.truth.monodromy",
    "floquet_multipliers": "gearbench.identification.truth.monodromy",
    "force": "gearbench.identification.spectra.transmission_error",
    "frozen_frf": "gearbench.identification.response.exact",
    "frozen_itf": "gearbench.identification.truth.periodic",
    "frozen_modes": "gearbench.identification.response.modes",
    "harmonic_balance_itf": "gearbench.identification.truth.harmonic_balance",
    "htf": "gearbench.identification.response.frf",
    "htf_from_itf": "gearbench.identification.truth.periodic",
    "identify": "gearbench.identification.estimation",
    "itf": "gearbench.identification.response.frf",
    "itf_from_htf": "gearbench.identification.truth.periodic",
    "itf_modes": "gearbench.identification.response.modes",
    "make_frf": "gearbench.identification.response.frf",
    "random_phase_multisine": "gearbench.identification.excitation.multisine",
    "read_frf": "gearbench.identification.response.frf",
    "truncation_error": "gearbench.identification.truth.periodic",
    "validate_frf": "gearbench.identification.response.frf",
    "write_frf": "gearbench.identification.response.frf",
}

# Imported on use: a multisine alone needs neither datasets nor estimators, which take a second to load.
__getattr__ = names_on_use(__name__, _HOMES)
