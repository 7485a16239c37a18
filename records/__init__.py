"""What comes back from a rig: the record, its channels, its file and its provenance.

`checks`: what a record alone tells of its own faults, `clocks`: those of time, `seen`: a record as both see it.
`formats`: files of measuring programs, one importer each. `conversion`: from their columns to a record. `pieces`: a
record written piece by piece.
"""

from gearbench.records.channels import unit_of_channel
from gearbench.records.conversion.channel_map import ChannelMap, ChannelSpec, map_text, read_map
from gearbench.records.conversion.guess import Guess, guess_map
from gearbench.records.errors import RecordError
from gearbench.records.formats.importers import read_source
from gearbench.records.formats.source import Source
from gearbench.records.provenance import provenance, source_digest
from gearbench.records.record import SCHEMA, make_record, validate_record
from gearbench.records.storage import opened_record, read_dataset, read_record, write_dataset, write_record

__all__ = [
    "SCHEMA",
    "ChannelMap",
    "ChannelSpec",
    "Guess",
    "RecordError",
    "Source",
    "guess_map",
    "make_record",
    "map_text",
    "opened_record",
    "provenance",
    "read_dataset",
    "read_map",
    "read_record",
    "read_source",
    "source_digest",
    "unit_of_channel",
    "validate_record",
    "write_dataset",
    "write_record",
]
