"""The launcher's decisions, with a stand-in for Python that writes down what it is asked to do.

The real installation is what `.ci/run` does.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LIBRARIES = ["libgl1", "libegl1", "libglu1-mesa", "libxcursor1", "libxft2", "libxinerama1", "libgomp1"]
SONAMES = ["libGL.so.1", "libEGL.so.1", "libGLU.so.1", "libXcursor.so.1"]
SONAMES += ["libXft.so.2", "libXinerama.so.1", "libgomp.so.1"]

# Stands in for python3: reports FAKE_VERSION, makes a virtual environment that is a copy of itself and writes
# down what pip is asked for. Scripts given with -c run in the real Python, so the lock is a real lock.
PYTHON = f"""#!/bin/sh
: "${{FAKE_VERSION:=3.11.9}}"
case "$*" in
    -V) echo "Python $FAKE_VERSION" ;;
    *sys.version_info*) echo "${{FAKE_VERSION%.*}}" ;;
    '-c import ensurepip') [ -z "${{FAKE_NO_VENV:-}}" ] ;;
    *find_spec*) exit "${{FAKE_FOREIGN:-0}}" ;;
    -c*) exec '{sys.executable}' "$@" ;;
    '-m venv --clear '*) mkdir -p "$4/bin"; cp "$0" "$4/bin/python"; echo venv >>"$LOG" ;;
    '-m pip install '*) echo "pip in $(pwd):" "$@" >>"$LOG"; echo noise
        echo "WARNING: Location is ignored" >&2; sleep "${{FAKE_PIP_SECONDS:-0}}"
        exit "${{FAKE_PIP_STATUS:-0}}" ;;
    *) echo "ran in $(pwd):" "$@" ;;
esac
"""


class Checkout:
    """A checkout with the real launcher and a PATH where python3, apt-get, id and ldconfig are stand-ins."""

    def __init__(self, place: Path, name: str = "check out") -> None:
        self.home, self.bin, self.log = place / name, place / "bin", place / "log"
        for folder in (self.home / "app", self.bin):
            folder.mkdir(parents=True, exist_ok=True)
        for name in ("gearbench", "pyproject.toml", "constraints.txt"):
            shutil.copy(ROOT / name, self.home / name)
        self.fake("python3", PYTHON)
        for older in ("python3.14", "python3.13", "python3.12", "python3.11"):
            self.fake(older, "#!/bin/sh\nexit 127\n")
        self.fake("apt-get", '#!/bin/sh\necho "apt-get $*" >>"$LOG"\n')
        self.user(1000)
        self.libraries(SONAMES)
        self.stamp = self.home / ".venv" / "gearbench-stamp"

    def fake(self, name: str, text: str) -> None:
        """Put an executable on the PATH."""
        (self.bin / name).write_text(text, encoding="utf-8")
        (self.bin / name).chmod(0o755)

    def user(self, number: int) -> None:
        """Who the launcher believes to be."""
        self.fake("id", f"#!/bin/sh\necho {number}\n")

    def libraries(self, names: list[str]) -> None:
        """What the loader of the system knows."""
        lines = "".join(f"\\t{name} (libc6,x86-64) => /lib/{name}\\n" for name in names)
        self.fake("ldconfig", f"#!/bin/sh\nprintf '{lines}'\n")

    def environment(self, **extra: str) -> dict[str, str]:
        """Environment of the launcher: the stand-ins come first."""
        kept = {key: value for key, value in os.environ.items() if not key.startswith("GEARBENCH_")}
        return kept | {"PATH": f"{self.bin}:{os.environ['PATH']}", "LOG": str(self.log)} | extra

    def start(self, *args: str, launcher: Path | None = None, **extra: str) -> subprocess.Popen[str]:
        """The launcher as a process with pipes and a process group of its own, beside the checkout."""
        launcher = launcher or self.home / "gearbench"
        # Tests started in the background ignore interrupts, and a child inherits that unless a handler is set.
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            return subprocess.Popen(
                [str(launcher), *args],
                cwd=launcher.parent.parent,
                env=self.environment(**extra),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                start_new_session=True,
            )
        finally:
            signal.signal(signal.SIGINT, before)

    def run(
        self, *args: str, launcher: Path | None = None, stdin: str = "", **extra: str
    ) -> tuple[int, str, str]:
        """Exit code, stdout and stderr of the launcher."""
        process = self.start(*args, launcher=launcher, **extra)
        out, err = process.communicate(stdin, timeout=60)
        return process.returncode, out, err

    def wait_for(self, word: str) -> None:
        """Wait until a stand-in has written the word down."""
        deadline = time.monotonic() + 20
        while not (self.log.exists() and word in self.log.read_text(encoding="utf-8")):
            assert time.monotonic() < deadline
            time.sleep(0.02)

    def asked(self) -> list[str]:
        """What the stand-ins were asked to do since the last call."""
        lines = self.log.read_text(encoding="utf-8").splitlines() if self.log.exists() else []
        self.log.unlink(missing_ok=True)
        return lines


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    return Checkout(tmp_path)


def test_launcher_is_executable_posix_shell() -> None:
    assert os.access(ROOT / "gearbench", os.X_OK)
    assert (ROOT / "gearbench").read_text(encoding="utf-8").startswith("#!/bin/sh\n")
    for shell in ("sh", "dash", "bash"):
        if shutil.which(shell):
            assert subprocess.run([shell, "-n", str(ROOT / "gearbench")], check=False).returncode == 0


def test_first_use_installs_and_later_use_does_not(checkout: Checkout, tmp_path: Path) -> None:
    code, out, err = checkout.run("run", "a case.toml", "--out", "o")
    assert (code, out) == (0, f"ran in {tmp_path}: -P -m gearbench run a case.toml --out o\n")
    assert err.splitlines() == [
        f"gearbench: setting up {checkout.home}/.venv with Python 3.11; this takes some minutes and 1.5 GB",
        "gearbench: set-up done",
    ]
    log = checkout.home / ".venv" / "set-up.log"
    assert log.read_text(encoding="utf-8") == "noise\nWARNING: Location is ignored\n"
    assert checkout.asked() == [
        "venv",
        f"pip in {checkout.home}: -m pip install --no-input --disable-pip-version-check --progress-bar off"
        " -c constraints.txt -e .[dev]",
    ]
    assert checkout.run("cases") == (0, f"ran in {tmp_path}: -P -m gearbench cases\n", "")
    assert checkout.asked() == []


def test_test_runs_pytest_in_the_checkout(checkout: Checkout) -> None:
    _, out, _ = checkout.run("test", "-k", "a or b")
    how = "-n auto --dist loadfile --no-loadscope-reorder"
    assert out == f"ran in {checkout.home}: -P -m pytest -m not validation {how} -k a or b\n"


def test_exit_code_is_that_of_the_command(checkout: Checkout) -> None:
    checkout.run("cases")
    python = checkout.home / ".venv" / "bin" / "python"
    python.write_text(PYTHON.replace('*) echo "ran in', '*) exit 130; echo "ran in'), encoding="utf-8")
    assert checkout.run("run")[0] == 130


def test_links_to_the_launcher_lead_home(checkout: Checkout, tmp_path: Path) -> None:
    elsewhere = tmp_path / "else where"
    elsewhere.mkdir()
    (elsewhere / "absolute").symlink_to(checkout.home / "gearbench")
    (elsewhere / "relative").symlink_to("absolute")
    code, out, _ = checkout.run("check", launcher=elsewhere / "relative")
    assert (code, out) == (0, f"ran in {tmp_path}: -P -m gearbench check\n")
    assert checkout.stamp.exists()


@pytest.mark.parametrize("version", ["2.7.18", "3.6.15", "3.9.18", "3.10.13"])
def test_old_python_is_refused_in_one_sentence(checkout: Checkout, version: str) -> None:
    code, out, err = checkout.run("cases", FAKE_VERSION=version)
    short = version.rsplit(".", 1)[0]
    assert (code, out) == (2, "")
    assert err == (
        f"gearbench: needs Python 3.11 or newer and found {short} (python3);"
        " install one, or name it in GEARBENCH_PYTHON\n"
    )
    assert checkout.asked() == [] and not (checkout.home / ".venv").exists()


def test_newer_python_beside_an_old_one_is_found(checkout: Checkout) -> None:
    checkout.fake("python3.12", PYTHON.replace(":=3.11.9", ":=3.12.1"))
    checkout.fake("python3", PYTHON.replace(":=3.11.9", ":=3.9.2"))
    code, _, err = checkout.run("cases")
    assert code == 0 and "with Python 3.12" in err
    assert checkout.stamp.read_text(encoding="utf-8").splitlines()[-1] == "Python 3.12"


def test_copied_checkout_is_set_up_anew(checkout: Checkout, tmp_path: Path) -> None:
    checkout.run("cases")
    checkout.asked()
    copy = tmp_path / "copy"
    shutil.copytree(checkout.home, copy, symlinks=True)
    assert checkout.run("cases", launcher=copy / "gearbench")[0] == 0
    assert checkout.asked()[1].startswith(f"pip in {copy}: ")
    assert str(copy) in (copy / ".venv" / "gearbench-stamp").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["pyproject.toml", "constraints.txt"])
def test_changed_dependencies_are_installed(checkout: Checkout, name: str) -> None:
    checkout.run("cases")
    checkout.asked()
    with (checkout.home / name).open("a", encoding="utf-8") as file:
        file.write("# another line\n")
    checkout.run("cases")
    assert checkout.asked()[0] == "venv"
    checkout.run("cases")
    assert checkout.asked() == []


def test_changed_python_is_seen(checkout: Checkout) -> None:
    checkout.run("cases")
    checkout.asked()
    checkout.run("cases", FAKE_VERSION="3.11.12")
    assert checkout.asked() == []
    checkout.run("cases", FAKE_VERSION="3.13.0")
    assert checkout.asked()[0] == "venv"


def test_failed_installation_is_tried_again(checkout: Checkout) -> None:
    code, out, err = checkout.run("cases", FAKE_PIP_STATUS="1")
    assert (code, out) == (1, "")
    assert err.splitlines()[1:3] == ["noise", "WARNING: Location is ignored"]
    assert f"pip could not install the packages (above the end of {checkout.home}/.venv/set-up.log)" in err
    assert not checkout.stamp.exists()
    assert checkout.run("cases")[0] == 0


def test_failed_renewal_leaves_no_stamp(checkout: Checkout) -> None:
    checkout.run("cases")
    (checkout.home / "constraints.txt").write_text("numpy==0\n", encoding="utf-8")
    assert checkout.run("cases", FAKE_PIP_STATUS="1")[0] == 1
    shutil.copy(ROOT / "constraints.txt", checkout.home)
    checkout.asked()
    assert checkout.run("cases")[0] == 0
    assert checkout.asked()[0] == "venv"


def test_code_of_another_checkout_is_refused(checkout: Checkout) -> None:
    code, out, err = checkout.run("cases", FAKE_FOREIGN="1")
    assert (code, out) == (1, "") and "not that of" in err
    assert not checkout.stamp.exists()


def interrupted(process: subprocess.Popen[str]) -> str:
    """Output of a process whose group is interrupted until it ends."""
    for _ in range(40):
        os.killpg(process.pid, signal.SIGINT)
        # A shell that is just between its fork and the stand-in's sleep loses a signal.
        with suppress(subprocess.TimeoutExpired):
            return process.communicate(timeout=0.5)[0]
    raise AssertionError("the process outlives its interruption")


def test_interrupted_set_up_is_no_set_up(checkout: Checkout) -> None:
    process = checkout.start("cases", FAKE_PIP_SECONDS="30")
    checkout.wait_for("pip")
    out = interrupted(process)
    assert process.returncode != 0 and out == ""
    assert not checkout.stamp.exists()
    assert checkout.run("cases")[0] == 0


def test_second_set_up_waits_and_uses_the_first(checkout: Checkout) -> None:
    first = checkout.start("cases", FAKE_PIP_SECONDS="1")
    checkout.wait_for("pip")
    second = checkout.start("check")
    assert second.stderr is not None
    assert second.stderr.readline() == "gearbench: waiting for another set-up of this checkout\n"
    assert first.poll() is None
    for process, command in ((first, "cases"), (second, "check")):
        out, _ = process.communicate(timeout=20)
        assert process.returncode == 0 and out.endswith(f"-P -m gearbench {command}\n")
    assert [line.split()[0] for line in checkout.asked()] == ["venv", "pip"]


def test_lock_left_by_a_dead_process_does_not_hold(checkout: Checkout) -> None:
    (checkout.home / ".venv.lock").touch()
    assert checkout.run("cases")[0] == 0


def test_root_installs_what_is_missing(checkout: Checkout) -> None:
    checkout.user(0)
    checkout.libraries(SONAMES[:3])
    code, _, err = checkout.run("cases", FAKE_NO_VENV="1")
    install = "install -y -qq --no-install-recommends python3.11-venv " + " ".join(LIBRARIES[3:])
    assert code == 0
    assert checkout.asked()[:2] == ["apt-get update -qq", f"apt-get {install}"]
    assert "gearbench: running: apt-get update -qq\n" in err
    assert f"gearbench: running: apt-get {install}\n" in err


def test_root_with_everything_leaves_apt_alone(checkout: Checkout) -> None:
    checkout.user(0)
    checkout.run("cases")
    assert [line for line in checkout.asked() if line.startswith("apt-get")] == []


def test_user_without_venv_is_given_the_line_to_type(checkout: Checkout) -> None:
    checkout.libraries(SONAMES[1:])
    code, out, err = checkout.run("cases", FAKE_NO_VENV="1")
    assert (code, out) == (2, "")
    assert err.endswith("type: sudo apt-get install -y python3.11-venv libgl1\n")
    assert checkout.asked() == []


def test_user_without_libraries_may_go_on_with_the_rest(checkout: Checkout) -> None:
    checkout.libraries([])
    code, out, err = checkout.run("cases")
    assert code == 0 and out.endswith("-m gearbench cases\n")
    assert err.endswith(f"type: sudo apt-get install -y {' '.join(LIBRARIES)}\n")


def test_set_up_does_not_wait_for_answers(checkout: Checkout) -> None:
    """Nothing of the set-up reads stdin, which belongs to the command."""
    greedy = PYTHON.replace("echo noise\n", "cat\n").replace('echo "ran in $(pwd):" "$@"', "cat")
    checkout.fake("python3", greedy)
    assert checkout.run("identify", stdin="for the command")[:2] == (0, "for the command")


def test_mesher_asks_for_the_libraries_the_launcher_installs() -> None:
    words = (ROOT / "geometry" / "mesh" / "filling.py").read_text(encoding="utf-8").replace('"', " ").split()
    assert set(LIBRARIES) <= {word.strip(",;:.)") for word in words}
    launcher = (ROOT / "gearbench").read_text(encoding="utf-8")
    assert all(f"{soname}={package}" in launcher for soname, package in zip(SONAMES, LIBRARIES, strict=True))
