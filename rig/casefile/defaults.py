"""What a case may leave unsaid: the values that an engineer would take, put into its table before it is read.

Each is said in a sentence, so that nobody has to guess what was computed.
"""

from __future__ import annotations

from decimal import Decimal
from math import ceil, log2
from pathlib import Path
from typing import Any, NamedTuple

from gearbench.rig.casefile.toml import Table
from gearbench.rig.gear import Gear

# Part of the root circle's radius at which a gear without bore is held.
HUB_PART = Decimal("0.6")
# Length of an excitation period that is aimed at [s], and samples over twice its highest frequency.
PERIOD = 1.0
OVERSAMPLING = 1.28
# Response is modulated by the mesh: so many branches above the band must lie below half of the sampling rate, or they
# fold back into it. Their identification wants more than one realisation.
BRANCHES = 24
REALISATIONS = 4
# Samples of a mesh period without excitation.
SAMPLES_PER_MESH = 256
# Keys of a changing speed: how long its record is only the case can say.
CHANGING = {"speed_end_rpm", "speed_table"}

# Stands for an experiment where a case has none; nothing reads it but what asks whether there is one.
PLACEHOLDER: Table = {
    "mesh_frequency_hz": 1,
    "torque_mean_nm": 1,
    "sampling_rate_hz": SAMPLES_PER_MESH,
    "samples_per_period": SAMPLES_PER_MESH,
}


class Completed(NamedTuple):
    """`assumed`: sentences, one for each value that was put in; `stated`: whether the case has an experiment."""

    assumed: tuple[str, ...]
    stated: bool


def complete(document: Table, path: Path) -> Completed:
    """Put into a case's table, in place, what it leaves out and what has a usual value. Whatever is not as it should
    be is left alone: reading the table finds it."""
    assumed = []
    if "name" not in document:
        document["name"] = path.stem
    rig = document.get("rig")
    if isinstance(rig, dict):
        assumed += [line for side in ("driver", "driven") if (line := _hub(rig.get(side), f"rig.{side}"))]
    conditions = document.get("condition")
    if "experiment" not in document and not (isinstance(conditions, list) and conditions):
        document["experiment"] = dict(PLACEHOLDER)
        return Completed(tuple(assumed), False)
    experiment = document.get("experiment")
    if isinstance(experiment, dict) and isinstance(rig, dict):
        assumed += _rigid(rig.get("support", {}))
        assumed += _sampling(experiment, rig.get("driver"))
    return Completed(tuple(assumed), True)


def _hub(gear: Any, where: str) -> str | None:
    """The radius at which a gear is held: that of its bore, or a part of the root circle's."""
    if not isinstance(gear, dict) or "hub_radius_mm" in gear:
        return None
    bore = _number(gear.get("bore_radius_mm"))
    if bore:
        gear["hub_radius_mm"] = bore
        return f"{where}.hub_radius_mm = {float(bore):g}: the gear is rigid from its bore inwards"
    module, teeth = _number(gear.get("module_mm")), _number(gear.get("teeth"))
    shift = _number(gear.get("profile_shift", _default("profile_shift")))
    dedendum = _number(gear.get("dedendum", _default("dedendum")))
    if module is None or teeth is None or shift is None or dedendum is None:
        return None
    root = module * (teeth / 2 + shift - dedendum)
    if root <= 0:
        return None
    gear["hub_radius_mm"] = hub = round(HUB_PART * root, 4)
    return f"{where}.hub_radius_mm = {float(hub):g}: the gear is rigid inside {100 * HUB_PART:.0f} % of its root circle"


def _rigid(supports: Any) -> list[str]:
    """What is said of supports without a stiffness, which hold a gear's centre where it is."""
    if not isinstance(supports, dict):
        return []
    own = {side: supports.get(side) for side in ("driver", "driven")}
    if "stiffness_n_per_m" in supports:
        return []
    held = [side for side, one in own.items() if not (isinstance(one, dict) and "stiffness_n_per_m" in one)]
    where = {2: "rig.support", 1: f"rig.support.{''.join(held)}"}
    return [f"{where[len(held)]}: rigid, as no stiffness_n_per_m is given"] if held else []


def _sampling(experiment: Table, driver: Any) -> list[str]:
    """Sampling rate and samples of a period: a period of about a second that holds whole mesh periods, sampled a good
    quarter above twice the highest excited frequency and above twice what the mesh makes of it, with several
    realisations; without excitation, one mesh period."""
    rate, samples = experiment.get("sampling_rate_hz"), experiment.get("samples_per_period")
    mesh = _mesh_frequency(experiment, driver)
    if (rate is not None and samples is not None) or not mesh or experiment.keys() & CHANGING:
        return []
    multisine = experiment.get("multisine")
    top = None
    if isinstance(multisine, dict) and isinstance(multisine.get("band_hz"), list) and len(multisine["band_hz"]) == 2:
        top = _number(multisine["band_hz"][1])
    if multisine is not None and not top:
        return []
    cycles, given = max(1, round(PERIOD * float(mesh))) if top else 1, _number(samples)
    if top and rate is None and given:  # rather a shorter period than one that is sampled too coarsely
        cycles = max(1, min(cycles, int(float(given) / _fewest(top, mesh, 1))))
    period, chosen = cycles / mesh, rate is None
    if rate is None:
        count = given or Decimal(2 ** max(4, ceil(log2(_fewest(top, mesh, cycles)))))
        rate = experiment["sampling_rate_hz"] = count / period
        said = [f"experiment.sampling_rate_hz = {float(rate):.10g}"]
    else:
        said = []
    if samples is None:
        known = _number(rate)
        if known is None:
            return []
        samples = experiment["samples_per_period"] = round(known * period)
        said.append(f"experiment.samples_per_period = {samples}")
    held = f"{cycles} mesh period{'s' if cycles > 1 else ''} a period"
    if not top:
        return [f"{' and '.join(said)}: {held}, without excitation"]
    reason = f", for a band up to {float(top):g} Hz and what the mesh makes of it"
    enough = chosen and float(rate) >= _fewest(top, mesh, 1) * float(mesh)
    return [f"{' and '.join(said)}: {held}{reason if enough else ''}", *_realisations(experiment)]


def _fewest(top: Decimal | None, mesh: Decimal, cycles: int) -> float:
    """Fewest samples that a period of so many mesh cycles may have."""
    if not top:
        return cycles * SAMPLES_PER_MESH
    highest = max(OVERSAMPLING * float(top), float(top) + BRANCHES * float(mesh))
    return 2 * highest * cycles / float(mesh)


def _realisations(experiment: Table) -> list[str]:
    """Number of realisations, of an experiment whose period is left to us as well."""
    if "realisations" in experiment:
        return []
    experiment["realisations"] = REALISATIONS
    return [f"experiment.realisations = {REALISATIONS}: the branches of the response want more than one"]


def _mesh_frequency(experiment: Table, driver: Any) -> Decimal | None:
    """Mesh frequency [Hz] that an experiment's table states, None where it does not."""
    given = _number(experiment.get("mesh_frequency_hz"))
    if given is not None:
        return given if given > 0 else None
    speed = _number(experiment.get("speed_driver_rpm"))
    teeth = _number(driver.get("teeth")) if isinstance(driver, dict) else None
    return speed * teeth / 60 if speed and teeth and speed > 0 and teeth > 0 else None


def _number(raw: Any) -> Decimal | None:
    """A plain finite number of a table, also one with a standard deviation; None for anything else."""
    if isinstance(raw, dict):
        raw = raw.get("value")
    if isinstance(raw, bool) or not isinstance(raw, int | float | Decimal):
        return None
    number = Decimal(str(raw))
    return number if number.is_finite() else None


def _default(name: str) -> Any:
    return Gear.model_fields[name].default
