"""What is doubtful about records, what it may cost, and when that is too much for a result."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot, sqrt

import xarray as xr

from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.task import IdentificationSettings
from gearbench.records import RecordError
from gearbench.records.checks import Finding, check_record, same_samples

# What a doubt may cost of the response unless it is accepted.
COSTS = 0.1
# Expected error from which on a result says nothing.
NOTHING = 1.0
ANYWAY = "--accept-doubts (accept_doubts = True) goes on all the same"


def doubts_about(records: Sequence[xr.Dataset], settings: IdentificationSettings) -> tuple[list[str], float]:
    """What is doubtful about the records, and the rms error that it may leave in the band.

    Records count alike, doubts about one are independent. Raises RecordError for records that hold the same samples,
    for what a check refuses, and, unless doubts are accepted, for a doubt that may cost more than COSTS.
    """
    copies = same_samples(records)
    if copies is not None and copies[0][0] != copies[1][0]:
        first, second = (place[0] + 1 for place in copies)
        raise RecordError(f"records {first} and {second} of {len(records)} hold the same samples: each one counts once")
    sentences, power = [], 0.0
    for record, source in _named(records):
        for finding in check_record(record, source):
            sentence = f"{source}: {finding.sentence}" if source else finding.sentence
            sentences.append(sentence)
            if finding.above is not None and settings.band is not None and settings.band[1] <= finding.above:
                continue
            if finding.error > COSTS and not settings.accept_doubts:
                raise RecordError(_too_costly(sentence, finding))
            power += finding.error**2 / len(records)
        if lost := int(record.attrs.get("contact_lost_samples", 0)):
            total = record.sizes["realisation"] * record.sizes["time"]
            sentence = (
                f"the teeth are out of contact in {lost} of {total} samples: the response depends on the excitation's"
                " size, which no error here counts; a coset multisine tells how much"
            )
            sentences.append(f"{source}: {sentence}" if source else sentence)
    return sentences, sqrt(power)


def _named(records: Sequence[xr.Dataset]) -> Iterator[tuple[xr.Dataset, str]]:
    """Each record with what sentences call it: a single one nothing."""
    for number, record in enumerate(records, start=1):
        yield record, f"record {number} of {len(records)}" if len(records) > 1 else ""


def _too_costly(sentence: str, finding: Finding) -> str:
    return f"{sentence}: refused, as it may cost {finding.error:.0%} of the response (limit {COSTS:.0%}); {ANYWAY}"


def require_response(frf: xr.Dataset) -> None:
    """Raise LpmError for a result that is expected to err by all of itself, apart from doubtful channels, which were
    accepted or cost little."""
    parts = (float(frf.attrs.get(name, 0.0)) for name in ("variance_error", "truncation_error", "unexplained_error"))
    expected = hypot(*parts)
    if expected < NOTHING:
        return
    raise LpmError(
        f"the response of this record is expected to err by {expected:.0%} of itself (limit {NOTHING:.0%}), which says"
        " nothing: its mesh period, channels or units are wrong, or it is too short or too noisy: more realisations"
        f" help; {ANYWAY}"
    )
