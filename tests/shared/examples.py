"""Examples of docstrings, run as they stand."""

from __future__ import annotations

import doctest
from collections.abc import Callable
from typing import Any


def failures(function: Callable[..., Any], name: str) -> tuple[int, bool]:
    """How many lines of a docstring's examples fail, and whether there are any that use the public face."""
    (test,) = doctest.DocTestFinder(recurse=False).find(function, name, globs={})
    runner = doctest.DocTestRunner()
    runner.run(test)
    used = any(f"gb.{name}(" in example.source for example in test.examples)
    return runner.failures, used
