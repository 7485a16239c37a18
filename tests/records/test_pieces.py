"""A record written piece by piece: read as it was made, refused where it is none, whole or not there."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from gearbench.files import DeferredFile, FileError
from gearbench.records import RecordError, make_record, opened_record, read_record
from gearbench.records.pieces import Head, Piece, write_pieces
from gearbench.records.tally import Tally

ATTRIBUTES = {"sampling_rate": 1000.0, "samples_per_period": 50, "periods": 2, "condition": "one", "mesh_period": None}
ABOUT = {"dte": {"period_scatter": 0.5}, "y_driver": {"delay": 1.0}}
CHANNELS = {name: np.random.default_rng(3).standard_normal((3, 100)) for name in ("dte", "force")}
HEAD = Head(3, 100, ATTRIBUTES, ABOUT, start=0.25)


def pieces(size: int = 30) -> Iterator[Piece]:
    """In an order of no kind."""
    for at in range(0, 100, size):
        for row in (2, 0, 1):
            yield Piece(row, at, {name: values[row, at : at + size] for name, values in CHANNELS.items()})


def test_it_reads_as_the_record_that_is_made_at_once(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    write_pieces(path, HEAD, pieces())
    made = make_record(CHANNELS, ATTRIBUTES, channel_attributes={"dte": ABOUT["dte"]}, start=0.25)
    assert read_record(path).identical(made)
    with opened_record(path) as record:
        assert float(record["force"][2, 99]) == CHANNELS["force"][2, 99]
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_no_record_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    spoilt = {name: np.where(np.arange(30) == 7, np.nan, 0.0) for name in CHANNELS}
    bad: list[tuple[Head, list[Piece], str]] = [
        (HEAD, list(pieces())[:-1], "10 samples of the record are missing"),
        (HEAD, [Piece(1, 60, spoilt)], r"channel dte holds 1 .* not finite, first at realisation 1, sample 67"),
        (HEAD, [Piece(0, 0, {"dte": np.zeros(100)})], "is missing; a record needs"),
        (Head(3, 99, ATTRIBUTES), [], r"the record has 99 samples, but samples_per_period x periods is 100"),
        (Head(3, 100, {"periods": 2}), [], "attribute sampling_rate is missing"),
    ]
    for head, given, words in bad:
        with pytest.raises(RecordError, match=words):
            write_pieces(path, head, given)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("room", [0, 500, 3000, 9000, 9600])
def test_a_disk_that_fills_up_is_told(room: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = DeferredFile.write
    written = 0

    def write(self: DeferredFile, data: bytes) -> int:
        nonlocal written
        written += len(memoryview(data).cast("B"))
        if written > room and self.error is None:
            self.error = OSError(errno.ENOSPC, "No space left on device")
        return plain(self, data)

    monkeypatch.setattr(DeferredFile, "write", write)
    with pytest.raises(FileError, match=r"r\.nc cannot be written: No space left on device"):
        write_pieces(tmp_path / "r.nc", HEAD, pieces())
    assert not list(tmp_path.iterdir())


def test_a_tally_is_that_of_the_whole() -> None:
    values = 1e6 + np.random.default_rng(1).standard_normal(1000)
    tally = Tally()
    for part in np.split(values, [1, 17, 600]):
        tally.add(part)
    assert tally.deviation == pytest.approx(values.std(), rel=1e-9)
    assert (tally.mean, tally.least, tally.most) == (pytest.approx(values.mean()), values.min(), values.max())
