"""Which importer reads a file: by its first bytes, and by its suffix where those do not tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gearbench.records.errors import RecordError
from gearbench.records.formats.hdf import read_hdf
from gearbench.records.formats.matlab import read_mat
from gearbench.records.formats.source import Source
from gearbench.records.formats.tdms import read_tdms
from gearbench.records.formats.text import read_text
from gearbench.records.formats.uff import read_uff
from gearbench.records.formats.wav import read_wav

_HDF5 = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class Importer:
    """A format: `read` a file whose head (its first 600 bytes) `knows` or, if it has no head, whose suffix is here."""

    format: str
    suffixes: tuple[str, ...]
    knows: Callable[[bytes], bool]
    read: Callable[[Path], Source]


IMPORTERS: tuple[Importer, ...] = (
    Importer("HDF5, NetCDF-4, MAT 7.3", (), lambda head: head[:8] == _HDF5 or head[512:520] == _HDF5, read_hdf),
    Importer("TDMS", (".tdms",), lambda head: head[:4] == b"TDSm", read_tdms),
    Importer("WAV", (".wav",), lambda head: head[:4] in (b"RIFF", b"RIFX", b"RF64"), read_wav),
    Importer("UFF", (".uff", ".unv"), lambda head: head.lstrip(b"\r\n")[:6] == b"    -1", read_uff),
    Importer("MAT", (".mat",), lambda head: head[:10] == b"MATLAB 5.0", read_mat),
    Importer("CSV, TSV", (".csv", ".tsv", ".txt", ".asc", ".dat"), lambda head: False, read_text),
)
_FOREIGN = {
    b"# Created by Octave": "is Octave's text format: save it with -v7",
    b"Octave-1-": "is Octave's binary format: save it with -v7",
    b"PK\x03\x04": "is a ZIP archive (or a spreadsheet): unpack it, or save the table as CSV",
    b"\x1f\x8b": "is compressed with gzip: unpack it first",
    b"CDF\x01": "is NetCDF-3: convert it with nccopy -k nc4",
    b"CDF\x02": "is NetCDF-3: convert it with nccopy -k nc4",
    b"\xd0\xcf\x11\xe0": "is an old Excel file: save the table as CSV",
    b"MDF ": "is a MDF measurement: export it as MAT or CSV",
}


def read_source(path: str | Path) -> Source:
    """The columns of a measured file. Raises RecordError (one sentence) for what is missing, damaged or no known
    format, and for a file without a single column."""
    file = Path(path)
    if not file.exists():
        raise RecordError(f"{file} does not exist")
    if not file.is_file():
        raise RecordError(f"{file} is no ordinary file")
    with file.open("rb") as stream:
        head = stream.read(600)
    if not head.strip():
        raise RecordError(f"{file} is empty")
    source = _importer(file, head).read(file)
    if not source.columns:
        why = "; ".join(f"{name} {reason}" for name, reason in list(source.skipped.items())[:3])
        raise RecordError(f"{file} holds no signal{f': {why}' if why else ''}")
    names = source.names
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise RecordError(f"{file} has {names.count(twice)} columns called {twice!r}: names must differ")
    return source


def _importer(file: Path, head: bytes) -> Importer:
    for start, reason in _FOREIGN.items():
        if head.startswith(start):
            raise RecordError(f"{file} {reason}")
    for importer in IMPORTERS:
        if importer.knows(head):
            return importer
    for importer in IMPORTERS:
        if file.suffix.lower() in importer.suffixes:
            return importer
    known = ", ".join(importer.format for importer in IMPORTERS)
    raise RecordError(f"{file} is of no known format: its first bytes and its suffix are none of {known}")
