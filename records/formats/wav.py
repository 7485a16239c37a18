"""WAV: one column a track, as a part of full scale."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from gearbench.records.errors import RecordError
from gearbench.records.formats.source import Source, first_line, make_column


def read_wav(path: Path) -> Source:
    """Tracks of a WAV file (PCM of 8 to 64 bits, or float), +-1 at full scale of PCM; the file knows no unit.

    One track has the name of the file, several `name[1]`, `name[2]`. Raises RecordError.
    """
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate, data = wavfile.read(path)
    except Exception as reason:  # the reader has no error of its own
        raise RecordError(f"{path} is truncated or no WAV file ({first_line(reason)})") from reason
    if data.size == 0:
        raise RecordError(f"{path} is a WAV file without samples")
    _check_length(path, data.nbytes)
    if data.dtype == np.uint8:
        values = (data.astype(np.float64) - 128.0) / 128.0
    elif data.dtype.kind == "i":
        # 24 bits are read left-aligned into 32.
        values = data.astype(np.float64) / -float(np.iinfo(data.dtype).min)
    else:
        values = data.astype(np.float64)
    tracks = values[:, np.newaxis] if values.ndim == 1 else values
    names = [path.stem] if tracks.shape[1] == 1 else [f"{path.stem}[{n + 1}]" for n in range(tracks.shape[1])]
    columns = [make_column(name, track, rate=float(rate)) for name, track in zip(names, tracks.T, strict=True)]
    return Source(path, "WAV", tuple(columns))


def _check_length(path: Path, held: int) -> None:
    """Refuse a file that ends before its own header says (the reader takes what there is)."""
    content = path.read_bytes()[:8]
    said = int.from_bytes(content[4:8], "big" if content[:4] == b"RIFX" else "little") + 8
    if content[:4] in (b"RIFF", b"RIFX") and said < 2**32 - 8 and path.stat().st_size < said:
        raise RecordError(f"{path} is truncated: its header says {said} bytes, it has {path.stat().st_size}")
