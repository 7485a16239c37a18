"""What comes back from a rig: the record, its channels, its file and its provenance.

`checks`: what a record alone can tell about itself, refused in a sentence or warned of.
"""

from gearbench.records.channels import unit_of_channel
from gearbench.records.errors import RecordError
from gearbench.records.provenance import provenance, source_digest
from gearbench.records.record import SCHEMA, make_record, validate_record
from gearbench.records.storage import read_dataset, read_record, write_dataset, write_record

__all__ = [
    "SCHEMA",
    "RecordError",
    "make_record",
    "provenance",
    "read_dataset",
    "read_record",
    "source_digest",
    "unit_of_channel",
    "validate_record",
    "write_dataset",
    "write_record",
]
