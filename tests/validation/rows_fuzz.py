"""Fuzzing: whatever is put in, an answer that holds or one sentence. GEARBENCH_FUZZ=40 tries the full numbers."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from math import cos, pi, radians, sin, sqrt, tan
from pathlib import Path

import numpy as np
import xarray as xr
from hypothesis import strategies as st
from scipy.optimize import brentq
from shared.hunting import command, complaint, hunt, scale
from shared.mutations import damaged_record, leaves, settings

from gearbench.bench.statics import static
from gearbench.cases import read_case
from gearbench.commands.checks import Check, Got
from gearbench.geometry import pair
from gearbench.geometry.error import GeometryError
from gearbench.records import read_record
from gearbench.rig import CaseError

SEED = 20260713
BASES = ("quick_lumped", "quick_fe", "gap_demo", "paper_lumped", "reference")
SMALL = {
    "experiment.realisations": "4",
    "experiment.samples_per_period": "2048",
    "experiment.sampling_rate_hz": "8192",
    "experiment.multisine.band_hz": "[4, 2500]",
    "identification.band_hz": "[100, 500]",
    "identification.harmonics": "4",
    "identification.order": "1",
    "identification.window": "6",
}
SMALL_RUN = ["quick_lumped", *(part for key, value in SMALL.items() for part in ("--set", f"{key}={value}"))]


def generator(number: int, row: int) -> np.random.Generator:
    """The stream of one example of one row: any finding can be had again by its number."""
    return np.random.default_rng([SEED, row, number])


def told(findings: list[str], tried: int, of: str) -> Got:
    """Findings as a number, the first ones in words."""
    words = "; ".join(findings[:3])
    return Got(len(findings), f"{tried} {of}" + (f"; {words}" if words else ""))


def cases() -> Got:
    """Cases with keys changed, and texts of any kind, through `check`."""
    known = {base: leaves(read_case(base)) for base in BASES}
    texts = st.text(max_size=30)
    count = round(250 * scale())

    def example(number: int) -> str | None:
        rng = generator(number, 0)
        base = str(rng.choice(BASES))
        chosen = settings(rng, known[base])
        if number % 5 == 0:
            key = str(rng.choice(list(known[base])))
            chosen.append(f"{key}={text_of(texts, number)}" if number % 2 else text_of(texts, number))
        return complaint(["check", base, *(part for one in chosen for part in ("--set", one))])

    return told(hunt(example, count), count, "cases")


def text_of(strategy: st.SearchStrategy[str], number: int) -> str:
    """A text that hypothesis finds worth trying; the same for the same number."""
    from hypothesis import HealthCheck, Phase, given, seed
    from hypothesis import settings as how

    found: list[str] = []

    @seed(number)
    @how(max_examples=3, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck), deadline=None)
    @given(strategy)
    def draw(text: str) -> None:
        found.append(text)

    draw()
    return found[-1].replace("\x00", "")


def oracles() -> Got:
    """Pairs that are taken, against closed forms: base pitch, contact ratio, mean stiffness within 2 of c_gamma."""
    count = round(150 * scale())
    findings = hunt(_pair_example, count)
    return told(findings, count, "pairs")


def _pair_example(number: int) -> str | None:
    rng = generator(number, 1)
    m = float(rng.choice([1.0, 2.0, 3.0, 5.0]))
    teeth = [int(rng.integers(18, 90)) for _ in range(2)]
    shifts = [round(float(rng.uniform(-0.1, 0.4)), 3) for _ in range(2)]
    width = round(float(rng.uniform(8, 14)) * m, 3)
    chosen: list[str] = []
    for side, z, x in zip(("driver", "driven"), teeth, shifts, strict=True):
        hub = round(0.7 * m * (z / 2 - 1.5), 3)
        values = {"teeth": z, "module_mm": m, "profile_shift": x, "face_width_mm": width, "hub_radius_mm": hub}
        # Of a disc to the tips, so that any hub's share is enough.
        radius = 1e-3 * m * (z / 2 + 2)
        mass = 7850 * pi * radius**2 * 1e-3 * width
        values |= {"mass_kg": mass, "inertia_kg_m2": mass * radius**2 / 2}
        values |= {"bore_radius_mm": 0, "tip_edge_radius_um": 0, "thinning_um": 0}
        chosen += [f"rig.{side}.{key}={value}" for key, value in values.items()]
    try:
        case = read_case("quick_lumped", chosen)
        found = pair(case.rig)
        result = static(case, positions=32, torque=[0.05 * width * teeth[0] * m * 2])
    except (CaseError, GeometryError) as error:
        return f"{error} of {chosen}"
    pitch, ratio = closed_forms(1e-3 * m, teeth, shifts)
    if abs(found.base_pitch - pitch) > 1e-9:
        return f"base pitch {found.base_pitch} and not {pitch} of {chosen}"
    if abs(found.contact_ratio - ratio) > 1e-6:
        return f"contact ratio {found.contact_ratio} and not {ratio} of {chosen}"
    mean = float(result["stiffness_tangent"].mean())
    wanted = c_gamma(teeth, shifts, ratio) * 1e-3 * width
    if not 0.5 < mean / wanted < 2.0:
        return f"stiffness {mean:.4g} N/m, c_gamma b = {wanted:.4g} N/m of {chosen}"
    return None


def closed_forms(m: float, teeth: list[int], shifts: list[float]) -> tuple[float, float]:
    """Base pitch [m] and contact ratio of two gears without tip rounding at zero backlash."""
    alpha = radians(20)
    inv = tan(alpha) - alpha + 2 * sum(shifts) * tan(alpha) / sum(teeth)
    working = brentq(lambda a: tan(a) - a - inv, 0.01, 1.2, xtol=1e-15)
    distance = m * sum(teeth) / 2 * cos(alpha) / cos(working)
    path = -distance * sin(working)
    for z, x in zip(teeth, shifts, strict=True):
        path += sqrt((m * (z / 2 + 1 + x)) ** 2 - (m * z / 2 * cos(alpha)) ** 2)
    pitch = pi * m * cos(alpha)
    return pitch, path / pitch


def c_gamma(teeth: list[int], shifts: list[float], ratio: float) -> float:
    """c_gamma [N/m^2] of solid steel gears by ISO 6336-1, equations 82-91, for the rack 1/1.25/20 degrees."""
    (z1, z2), (x1, x2) = teeth, shifts
    q = 0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2 - 0.24188 * x2 / z2
    q += 0.00529 * x1**2 + 0.00182 * x2**2
    return 0.8 * 0.975 / q * (0.75 * ratio + 0.25) * 1e9


def records() -> Got:
    """Damaged records through `identify`, `compare` and `diagnose`."""
    count = round(50 * scale())
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        whole = folder / "whole.nc"
        command(["simulate", *SMALL_RUN, "--out", str(whole)])
        record, content = read_record(whole), whole.read_bytes()
        hurt = folder / "hurt.nc"

        def example(number: int) -> str | None:
            kind = damaged_record(generator(number, 2), record, content, hurt)
            options = ["--band-hz", "100", "300", "--harmonics", "3", "--order", "1", "--window", "6"]
            commands = (
                ["identify", str(hurt), "--out", str(folder / "frf.nc"), *options],
                ["compare", str(whole), str(hurt), "--out", str(folder / "out"), "--force"],
                ["diagnose", str(hurt), "--rig", "quick_lumped", "--out", str(folder / "diagnosis"), "--force"],
            )
            wrong = complaint(commands[number % 3])
            return f"{kind}: {wrong}" if wrong else None

        return told(hunt(example, count), count, "records")


def full_disk() -> Got:
    """Every writer with room for a random part of what it writes: a sentence, and nothing left behind."""
    count = round(24 * scale())
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        record = folder / "record.nc"
        command(["simulate", *SMALL_RUN, "--out", str(record)])
        options = ["--band-hz", "100", "300", "--harmonics", "3", "--order", "1", "--window", "6"]
        static_run = ["static", "quick_lumped", "--positions", "8", "--torque-nm", "50"]
        writers: list[tuple[str, Callable[[Path], list[str]]]] = [
            ("a.nc", lambda out: ["simulate", *SMALL_RUN, "--out", str(out)]),
            ("b.nc", lambda out: ["identify", str(record), "--out", str(out), *options]),
            ("c.nc", lambda out: [*static_run, "--out", str(out)]),
            ("d.png", lambda out: [*static_run, "--out", str(folder / "c.nc"), "--figure", str(out)]),
            ("e.svg", lambda out: [*static_run, "--out", str(folder / "c.nc"), "--figure", str(out)]),
            ("f.dxf", lambda out: ["mesh", "quick_lumped", "--out", str(out)]),
            ("out", lambda out: ["compare", str(record), str(record), "--out", str(out), "--force"]),
            ("run", lambda out: ["run", *SMALL_RUN, "--out", str(out), "--force"]),
        ]
        for name, arguments in writers:
            command(arguments(folder / name))
        sizes = {name: _largest(folder / name) for name, _ in writers}
        static_size = _largest(folder / "c.nc")

        def example(number: int) -> str | None:
            name, arguments = writers[number % len(writers)]
            least = static_size + 1 if name in ("d.png", "e.svg") else 0
            if name in ("out", "run"):  # nothing to take up
                shutil.rmtree(folder / name, ignore_errors=True)
            limit = int(generator(number, 3).integers(least, sizes[name]))
            return _in_room(limit, arguments(folder / name), folder)

        return told(hunt(example, count), count, "writes")


def _largest(path: Path) -> int:
    return max(one.stat().st_size for one in ([path] if path.is_file() else path.iterdir()))


def _in_room(limit: int, arguments: list[str], folder: Path) -> str | None:
    """What is wrong with how a command ends when no file may grow beyond `limit` bytes."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        code, _, err = command(arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    left = [str(path) for path in folder.rglob(".gearbench-*")]
    if code == 2 and "cannot be written: File too large" in err and not left:
        return None
    return f"exit {code} with room for {limit} bytes of `{' '.join(arguments)}`, left {left}: {err.strip()[-300:]}"


def kills() -> Got:
    """`run` killed at random moments and taken up again: the products are those of a run that nobody killed."""
    count = round(2 * scale())
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        started = time.monotonic()
        _process(folder / "whole").wait()
        usual = time.monotonic() - started
        wanted = {path.name: path for path in (folder / "whole").iterdir()}
        findings = []
        for number in range(count):
            rng = generator(number, 4)
            out = folder / f"killed{number}"
            for _ in range(2):
                process = _process(out)
                try:
                    process.wait(timeout=float(rng.uniform(0.1, 1.0)) * usual)
                except subprocess.TimeoutExpired:
                    os.kill(process.pid, signal.SIGKILL)
                    process.wait()
            if code := _process(out).wait():
                findings.append(f"{number}: exit {code} of the run that takes up")
                continue
            names = {path.name for path in out.iterdir()}
            if names != set(wanted):
                findings.append(f"{number}: {sorted(names ^ set(wanted))} more or less")
            findings += [f"{number}: {name}" for name in names & set(wanted) if not _same(out / name, wanted[name])]
        return told(findings, count, "runs, each killed twice")


def _process(out: Path) -> subprocess.Popen[bytes]:
    arguments = [sys.executable, "-P", "-m", "gearbench", "run", *SMALL_RUN, "--out", str(out)]
    return subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _same(one: Path, two: Path) -> bool:
    if one.suffix != ".nc":
        return one.name in ("run.json", "summary.json", "summary.md") or one.read_bytes() == two.read_bytes()
    first, second = (xr.load_dataset(path, engine="h5netcdf", decode_cf=False) for path in (one, two))
    return bool(first.equals(second))


CHECKS = [
    Check("fuzz-cases", "cases and settings that end in neither an answer nor a sentence", 0, "", cases),
    Check("fuzz-oracles", "pairs whose geometry or stiffness departs from closed forms", 0, "", oracles),
    Check("fuzz-records", "damaged records that end in neither an answer nor a sentence", 0, "", records),
    Check("fuzz-full-disk", "writers that a full disk makes crash, fall silent or leave something", 0, "", full_disk),
    Check("fuzz-kills", "products that a kill at a random moment changes", 0, "", kills),
]
