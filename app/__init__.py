"""gearbench: a virtual gear test rig.

    import gearbench as gb

    case = gb.read_case("quick_lumped")     what is tested and how: SI values
    record = gb.simulate(case)              what the rig hands back
    frf = gb.identify([record])             its time-varying frequency response

All data are `xarray.Dataset` in SI units. A function that cannot do what it is asked raises a ValueError of its package
with one sentence. Names are imported on use: `import gearbench` itself loads nothing. Sub-packages, each of which says
what is in it: `rig`, `records`, `geometry`, `fem`, `lumped`, `identification`, `bench`, `diagnosis`, `challenge`,
`cases`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearbench.animation import animate
    from gearbench.bench import Comparison, compare, convert, simulate, simulate_to, static
    from gearbench.cases import read_case
    from gearbench.diagnosis import diagnose
    from gearbench.identification import (
        IdentificationSettings,
        dte,
        force,
        htf,
        identify,
        itf,
        read_frf,
        write_frf,
    )
    from gearbench.optimisation import optimise
    from gearbench.pipeline import run
    from gearbench.records import make_record, read_record, validate_record, write_record
    from gearbench.rig import Case, dump_case
    from gearbench.studies import campaign

__version__ = "0.1.0"

# Every public name and the package that it comes from.
_HOMES = {
    "Case": "gearbench.rig",
    "Comparison": "gearbench.bench",
    "IdentificationSettings": "gearbench.identification",
    "animate": "gearbench.animation",
    "campaign": "gearbench.studies",
    "compare": "gearbench.bench",
    "convert": "gearbench.bench",
    "diagnose": "gearbench.diagnosis",
    "dte": "gearbench.identification",
    "dump_case": "gearbench.rig",
    "force": "gearbench.identification",
    "htf": "gearbench.identification",
    "identify": "gearbench.identification",
    "itf": "gearbench.identification",
    "make_record": "gearbench.records",
    "optimise": "gearbench.optimisation",
    "read_case": "gearbench.cases",
    "read_frf": "gearbench.identification",
    "read_record": "gearbench.records",
    "run": "gearbench.pipeline",
    "simulate": "gearbench.bench",
    "simulate_to": "gearbench.bench",
    "static": "gearbench.bench",
    "validate_record": "gearbench.records",
    "write_frf": "gearbench.identification",
    "write_record": "gearbench.records",
}
_PACKAGES = (
    "bench",
    "cases",
    "challenge",
    "diagnosis",
    "fem",
    "geometry",
    "identification",
    "lumped",
    "records",
    "rig",
)

__all__ = [
    "Case",
    "Comparison",
    "IdentificationSettings",
    "animate",
    "campaign",
    "compare",
    "convert",
    "diagnose",
    "dte",
    "dump_case",
    "force",
    "htf",
    "identify",
    "itf",
    "make_record",
    "optimise",
    "read_case",
    "read_frf",
    "read_record",
    "run",
    "simulate",
    "simulate_to",
    "static",
    "validate_record",
    "write_frf",
    "write_record",
]


def __getattr__(name: str) -> Any:
    """A public name or a sub-package, imported when it is first asked for (PEP 562)."""
    if name in _HOMES:
        value = getattr(import_module(_HOMES[name]), name)
    elif name in _PACKAGES:
        value = import_module(f"gearbench.{name}")
    else:
        raise AttributeError(f"module 'gearbench' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES, "__version__"])
