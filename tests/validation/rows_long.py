"""The tests that take too long for every change: convergence, second formulations on fine meshes, whole runs."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as Xml
from pathlib import Path

from gearbench.commands.house.checks import Check, Got, NotRun

TESTS = Path(__file__).resolve().parents[1]


def failing() -> Got:
    """Tests outside of this folder that are marked `validation` and fail."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "told.xml"
        command = [sys.executable, "-P", "-m", "pytest", "-m", "validation", "-n", "auto", "--dist", "loadfile"]
        command += [f"--junitxml={told}", f"--ignore={Path(__file__).parent}", str(TESTS)]
        subprocess.run(command, cwd=TESTS.parent, env=os.environ, stdout=sys.stderr, check=False)
        if not told.exists():
            raise NotRun("pytest, which comes with the development packages, made no report")
        suite = Xml.parse(told).getroot()[0]
    count = {key: int(suite.attrib[key]) for key in ("tests", "failures", "errors", "skipped")}
    if count["tests"] == count["skipped"]:
        raise NotRun("no such test was found")
    spoilt = [one.attrib["name"] for one in suite.iter("testcase") if {"failure", "error"} & {part.tag for part in one}]
    return Got(count["failures"] + count["errors"], f"of {count['tests']}" + "".join(f"; {name}" for name in spoilt))


CHECKS = [Check("long-tests", "tests marked `validation` that fail", 0.0, "tests", failing)]
