"""`open DIR`: a report in the browser."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer


def open_report(
    what: Annotated[
        Path, typer.Argument(metavar="DIR|FILE", help="folder of a run, a report, or a result with a report beside it")
    ],
) -> None:
    """Show a report in the browser; without one, print where it is."""
    from gearbench.report.where import find_report

    page = find_report(what).resolve()
    typer.echo(str(page))
    if not shown(page):
        from gearbench.shell.failure import say

        say("no browser can be opened here: copy this file to a machine that has one, it needs nothing else")


def shown(page: Path) -> bool:
    """Whether a browser was opened on the page. Where there is no screen only one that BROWSER names is asked."""
    screen = sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if not (screen or os.environ.get("BROWSER")):
        return False  # text browsers would take the terminal
    import webbrowser

    try:
        return webbrowser.open(page.as_uri())
    except (webbrowser.Error, OSError):
        return False
