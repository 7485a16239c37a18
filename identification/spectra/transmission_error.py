"""Dynamic transmission error (DTE) and generalised force of a record: as stored, else from its channels
(docs/physics.md, "Axes, signs, zeros")."""

from __future__ import annotations

import xarray as xr

from gearbench.records.transmission_error import (
    AngleOnlyWarning,
    TransmissionError,
    dte_of_channels,
    force_of_torques,
)

__all__ = ["AngleOnlyWarning", "TransmissionError", "dte", "force"]


def dte(record: xr.Dataset) -> xr.DataArray:
    """DTE [m] (realisation, time); a `dte` channel of the record is passed through.

    Else from angles and displacements (`dte_of_channels`), which raises TransmissionError where something is missing.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"]))
    >>> found = gb.dte(record.drop_vars("dte"))  # from angles and displacements, as of a measurement
    >>> bool(abs(found - record["dte"]).max() < 1e-12)
    True
    """
    return record["dte"] if "dte" in record else dte_of_channels(record)


def force(record: xr.Dataset) -> xr.DataArray:
    """Generalised force F [N] (realisation, time); a `force` channel of the record is passed through.

    Else from the torques (`force_of_torques`), which raises TransmissionError where something is missing.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=1"]))
    >>> found = gb.force(record.drop_vars("force"))
    >>> f"{float(found.mean()):.0f} {found.attrs['units']}"
    '3433 N'
    """
    return record["force"] if "force" in record else force_of_torques(record)
