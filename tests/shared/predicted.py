"""Predicted variances against the scatter of repeated noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from gearbench.identification import htf, itf


def assert_deviations_are_as_predicted(found: Sequence[xr.Dataset]) -> None:
    """Deviations of ITF, HTF and mesh stiffness that results of other draws of noise state are 0.8 to 1.6 times those
    that they have."""
    for values, variance in (
        ([itf(frf).values for frf in found], "itf_var"),
        ([htf(frf).values for frf in found], "htf_var"),
        ([frf.mesh_stiffness.values for frf in found], "mesh_stiffness_var"),
    ):
        empirical = np.mean(np.var(np.array(values), axis=0, ddof=1))
        predicted = np.mean([frf[variance].values.mean() for frf in found])
        assert 0.8 < np.sqrt(predicted / empirical) < 1.6, variance
