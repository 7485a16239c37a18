"""What the machine has of what gearbench needs: `examine` looks, and says each thing in one sentence."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any, Literal

State = Literal["good", "note", "missing"]

GIB = 2**30
LEAST_PYTHON = (3, 11)
LEAST_DISK = 1.0  # [GiB]; a run with its pictures takes less than 0.1, compiled loops and condensed gears 0.3
LEAST_MEMORY = 1.0  # [GiB]; a run with finite elements peaks at 0.6
MUCH_MEMORY = 4.0  # [GiB]; long records of many realisations
# Programs that some pages and pictures take where they are found, and what they are for.
PROGRAMS: Mapping[tuple[str, ...], str] = {
    ("chromium", "chromium-browser", "google-chrome", "firefox"): "a browser shows reports",
    ("ffmpeg",): "ffmpeg writes moving pictures as MP4",
    ("ccx",): "CalculiX solves what `mesh --out pair.inp` writes",
}


@dataclass(frozen=True)
class Finding:
    """One thing looked at: `missing` keeps commands from running, a `note` does not."""

    name: str
    state: State
    sentence: str


def examine(folder: Path | None = None) -> list[Finding]:
    """Everything that is looked at on this machine; `folder` is where results are to go (None: here).

    Takes some seconds: whether gmsh loads and whether pyvista draws is tried, in processes of their own.
    """
    place = folder or Path.cwd()
    looks: tuple[Callable[[], Finding], ...] = (
        python,
        packages,
        pins,
        mesher,
        drawing,
        cores,
        memory,
        cache,
        lambda: disk("disk for results", place),
        lambda: disk("disk for temporary files", Path(tempfile.gettempdir())),
    )
    return [*(look() for look in looks), *programs()]


def python(found: tuple[int, ...] = sys.version_info[:3]) -> Finding:
    """The Python that runs this."""
    said = ".".join(map(str, found))
    if found[:2] < LEAST_PYTHON:
        return Finding("python", "missing", f"Python {said} is too old: 3.11 or newer is needed.")
    return Finding("python", "good", f"Python {said} in {sys.prefix}.")


def packages() -> Finding:
    """The declared dependencies, by their installed versions."""
    from packaging.requirements import Requirement

    wanted = [Requirement(line) for line in requires("gearbench") or []]
    wanted = [one for one in wanted if one.marker is None or one.marker.evaluate({"extra": ""})]
    lacking = [one for one in wanted if _lacks(one)]
    if lacking:
        said = ", ".join(f"{one.name} ({_version(one.name) or 'absent'}, needed {one.specifier})" for one in lacking)
        return Finding("packages", "missing", f"Install anew, for packages are absent or too old: {said}.")
    return Finding("packages", "good", f"All {len(wanted)} packages that gearbench needs are installed.")


def _lacks(requirement: Any) -> bool:
    found = _version(requirement.name)
    return found is None or not requirement.specifier.contains(found, prereleases=True)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def pins(file: Path | None = None) -> Finding:
    """Installed versions against those that the tests ran with, which a checkout names in constraints.txt."""
    file = file or Path(__file__).resolve().parent.parent / "constraints.txt"
    if not file.is_file():
        return Finding("versions", "note", "Versions are not compared: only a checkout names those it was tested with.")
    pinned = (line.split("==") for line in file.read_text(encoding="utf-8").splitlines() if "==" in line)
    found = [(name, wanted.strip(), _version(name)) for name, wanted in pinned]
    others = [f"{name} {got} (tested: {wanted})" for name, wanted, got in found if got and got != wanted]
    if others:
        return Finding("versions", "note", f"Other versions than those tested: {', '.join(others)}.")
    return Finding("versions", "good", f"Installed versions are those of {file.name}.")


def mesher(command: tuple[str, ...] = (sys.executable, "-P", "-c", "import gmsh")) -> Finding:
    """Whether gmsh loads with its system libraries; the import ends some processes, so another one tries."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return Finding("gmsh", "good", "gmsh loads: finite elements can be meshed.")
    lines = done.stderr.strip().splitlines() or [f"it ended with {done.returncode}"]
    library = re.search(r"(\S+\.so[.\d]*): cannot open", done.stderr)
    reason = f"the system library {library[1]} is absent" if library else lines[-1]
    return Finding(
        "gmsh",
        "missing",
        f"Finite elements cannot be meshed, for gmsh does not load ({reason}). On Debian type: sudo apt-get install -y"
        " libgl1 libegl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1",
    )


def drawing() -> Finding:
    """Whether pyvista draws without a screen, and whether there is one."""
    from gearbench.figures.gears.stress_scene import can_render

    screen = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    where = "with a screen" if screen else "without a screen"
    if can_render():
        return Finding("drawing", "good", f"pyvista draws here, {where}.")
    return Finding(
        "drawing",
        "note",
        f"pyvista cannot draw here ({where}, no EGL or OSMesa): stress fields are drawn by matplotlib. On Debian"
        " libegl1 and libgl1-mesa-dri help.",
    )


def cores() -> Finding:
    """The processors that this process may use."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return Finding("cores", "good", f"{count} processor{'s' if count > 1 else ''} to use.")


def memory(table: Path = Path("/proc/meminfo")) -> Finding:
    """Memory that is free, as Linux counts it."""
    try:
        match = re.search(r"MemAvailable:\s+(\d+) kB", table.read_text(encoding="utf-8"))
    except OSError:
        match = None
    if match is None:
        return Finding("memory", "note", "How much memory is free cannot be told here.")
    free = int(match[1]) * 1024 / GIB
    if free < LEAST_MEMORY:
        said = f"{free:.1f} GiB of memory are free; finite elements need {LEAST_MEMORY:g}."
        return Finding("memory", "missing", said)
    if free < MUCH_MEMORY:
        return Finding("memory", "note", f"{free:.1f} GiB of memory are free: long records may not fit.")
    return Finding("memory", "good", f"{free:.1f} GiB of memory are free.")


def cache() -> Finding:
    """The folder of compiled loops and condensed gears: whose it is, its size, the room beside it."""
    from gearbench.kernels.folders import cache_folder
    from gearbench.kernels.trust import CacheError

    try:
        folder = cache_folder()
    except CacheError as error:
        return Finding("cache", "missing", f"{str(error)[0].upper()}{str(error)[1:]}.")
    if not os.access(folder, os.W_OK):
        return Finding(
            "cache",
            "note",
            f"The cache folder {folder} cannot be written: every process compiles its loops anew, which takes most of"
            " a minute. GEARBENCH_CACHE names another.",
        )
    size = sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file()) / GIB
    room = disk("cache", folder)
    if room.state != "good":
        return room
    return Finding("cache", "good", f"The cache {folder} holds {1024 * size:.0f} MiB; no stranger can write there.")


def disk(name: str, folder: Path) -> Finding:
    """Room in a folder, and whether one may write there."""
    if not os.access(folder, os.W_OK):
        return Finding(name, "missing", f"{folder} cannot be written.")
    free = shutil.disk_usage(folder).free / GIB
    if free < LEAST_DISK:
        return Finding(name, "missing", f"{free:.2f} GiB are free in {folder}; {LEAST_DISK:g} are needed.")
    return Finding(name, "good", f"{free:.0f} GiB are free in {folder}.")


def programs() -> Iterator[Finding]:
    """Programs beside gearbench that are used where they are found."""
    for names, purpose in PROGRAMS.items():
        found = next((name for name in names if shutil.which(name)), None)
        if found:
            yield Finding(found, "good", f"{found} is there: {purpose}.")
        else:
            yield Finding(names[0], "note", f"{names[0]} is not there: {purpose}.")
