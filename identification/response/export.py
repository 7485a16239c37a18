"""A frequency response for other programs: universal file (dataset 58) and MAT-file of version 5."""

from __future__ import annotations

import contextlib
import io
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearbench.files import write_whole
from gearbench.identification.response.frf import FrfError, htf, itf, validate_frf

SUFFIXES = (".uff", ".unv", ".mat")
# Of dataset 58: function and ordinate data types, spacing, and what an axis holds.
_FREQUENCY_RESPONSE, _COMPLEX_DOUBLE, _EVEN, _UNEVEN = 4, 6, 1, 0
_DISPLACEMENT, _FORCE, _FREQUENCY = 8, 13, 18
_EVENLY = 1e-9  # departure from equal steps, and of a printed number, relative
_NO_UNIT = "1"
_LINE = 80  # characters of a line in the header of dataset 58


def export_frf(frf: xr.Dataset, path: str | Path) -> None:
    """Write a frequency response for other programs; the suffix says which file: .uff, .unv or .mat.

    Universal file: dataset 164 (SI), then one complex function 58 [m/N] for each phase of the ITF ("ITF at mesh
    phase 0.25", response node 1 + number of the phase) and for each branch of the HTF ("HTF of harmonic -2",
    response node 1001 + number of the branch, above 1000 phases the next thousand); frequencies have that format's
    six digits; lines 3 to 5 of its header hold the expected error and the first warnings, such as that dte holds the
    angles only. MAT-file (version 5): struct `frf` with the complex matrices itf (frequency x phase) and htf (harmonic
    x frequency), every other variable and coordinate under its name, `units` and `attributes`. Raises FrfError for
    another suffix or dataset.

    >>> import gearbench as gb
    >>> record = gb.simulate(gb.read_case("quick_lumped", ["experiment.realisations=2"]))
    >>> settings = gb.IdentificationSettings(harmonics=8, order=1, window=12, band=(1200.0, 1300.0), phases=8)
    >>> gb.identification.export_frf(gb.identify([record], settings), "frf.uff")
    """
    validate_frf(frf)
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise FrfError(f"{path} must end in {', '.join(SUFFIXES)} to be written for other programs")
    write_whole(path, lambda temporary: (_write_mat if suffix == ".mat" else _write_universal)(frf, temporary))


def _write_mat(frf: xr.Dataset, path: Path) -> None:
    from scipy.io import savemat

    values: dict[str, Any] = {str(name): frf[name].values for name in (*frf.coords, *frf.data_vars)}
    units = {name: str(frf[name].attrs.get("units", _NO_UNIT)) for name in values}
    for name, response in (("itf", itf(frf)), ("htf", htf(frf))):
        values[name] = response.values
        units[name] = units[f"{name}_re"]
        for part in ("re", "im"):
            del values[f"{name}_{part}"], units[f"{name}_{part}"]
    about = {str(key): value for key, value in frf.attrs.items()}
    savemat(path, {"frf": {**values, "units": units, "attributes": about}}, long_field_names=True, oned_as="column")


def _write_universal(frf: xr.Dataset, path: Path) -> None:
    import pyuff

    units = pyuff.prepare_164(
        units_code=1, units_description="SI: Meter (newton)", temp_mode=1, length=1.0, force=1.0, temp=1.0,
        temp_offset=273.15, return_full_dict=True,
    )  # fmt: skip
    phases, branches = itf(frf), htf(frf)
    functions = [
        (phases.values[:, number], f"ITF at mesh phase {phase:.6g}", 1 + number)
        for number, phase in enumerate(frf["phase"].values)
    ]
    first = 1 + 1000 * -(-max(frf.sizes["phase"], 1) // 1000)
    functions += [
        (branches.values[number], f"HTF of harmonic {harmonic}", first + number)
        for number, harmonic in enumerate(frf["harmonic"].values)
    ]
    # pyuff reads the whole file again after each dataset: each one gets a file of its own, which are then joined.
    with tempfile.TemporaryDirectory() as folder, path.open("wb") as joined, contextlib.redirect_stdout(io.StringIO()):
        single = Path(folder) / "one.uff"
        for one in (units, *(_function(frf, *about) for about in functions)):
            pyuff.UFF(str(single)).write_sets(one, mode="overwrite")
            joined.write(single.read_bytes())


def _function(frf: xr.Dataset, values: np.ndarray, title: str, node: int) -> dict[str, Any]:
    """Dataset 58 of one complex function of frequency."""
    frequency = frf["frequency"].values
    start, step = float(frequency[0]), float((frequency[-1] - frequency[0]) / max(frequency.size - 1, 1))
    # The header prints six digits; steps that need more are written point by point.
    even = frequency.size > 1 and all(abs(float(f"{value:.5e}") - value) <= _EVENLY * value for value in (start, step))
    even = even and bool(np.abs(np.diff(frequency) - step).max() < _EVENLY * frequency[-1])
    import pyuff

    about = f"gearbench, {frf.attrs['kind']}, mesh frequency {float(frf.attrs.get('mesh_frequency', np.nan)):.6g} Hz"
    quality, *warned = _said(frf)
    made: dict[str, Any] = pyuff.prepare_58(
        binary=0, id1=title, id2=about, id3=quality, id4=warned[0], id5=warned[1],
        func_type=_FREQUENCY_RESPONSE, ver_num=0, load_case_id=0,
        rsp_ent_name="DTE", rsp_node=node, rsp_dir=0, ref_ent_name="FORCE", ref_node=1, ref_dir=0,
        ord_data_type=_COMPLEX_DOUBLE, num_pts=frequency.size, abscissa_spacing=_EVEN if even else _UNEVEN,
        abscissa_min=start, abscissa_inc=step if even else 0.0, z_axis_value=0.0,
        abscissa_spec_data_type=_FREQUENCY, abscissa_len_unit_exp=0, abscissa_force_unit_exp=0,
        abscissa_temp_unit_exp=0, abscissa_axis_units_lab="Hz", ordinate_spec_data_type=_DISPLACEMENT,
        ordinate_len_unit_exp=1, ordinate_force_unit_exp=0, ordinate_temp_unit_exp=0, ordinate_axis_units_lab="m",
        orddenom_spec_data_type=_FORCE, orddenom_len_unit_exp=0, orddenom_force_unit_exp=1, orddenom_temp_unit_exp=0,
        orddenom_axis_units_lab="N", z_axis_spec_data_type=0, z_axis_len_unit_exp=0, z_axis_force_unit_exp=0,
        z_axis_temp_unit_exp=0, z_axis_axis_units_lab="NONE", data=values, x=frequency, return_full_dict=True,
    )  # fmt: skip
    return made


def _said(frf: xr.Dataset) -> list[str]:
    """Three lines of a header: what the response may err by, and the first two of its warnings."""
    error = frf.attrs.get("expected_error")
    quality = "NONE" if error is None else f"expected error {float(error):.2%} of the ITF, by {frf.attrs['method']}"
    warned = [line for line in str(frf.attrs.get("warnings", "")).splitlines() if line]
    lines = [quality, *warned[:2], "NONE", "NONE"][:3]
    ascii_only = [line.encode("ascii", "replace").decode() for line in lines]
    return [line if len(line) <= _LINE else f"{line[: _LINE - 3]}..." for line in ascii_only]
