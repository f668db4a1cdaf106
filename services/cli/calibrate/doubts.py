"""What looks like a slip is asked about: a person at a terminal answers, everybody else is told of
--yes.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer

from rhot.errors import CalibrationError


def settle(doubts: Sequence[str], *, yes: bool) -> None:
    """Return if there is no doubt, or if --yes or the person says that it is really so.

    Raises CalibrationError, with the doubts, if not.
    """
    found = [doubt for doubt in doubts if doubt]
    if not found:
        return
    text = ". ".join(found)
    if yes:
        typer.echo(f"note: {text}. Taken as it is (--yes)", err=True)
        return
    if not sys.stdin.isatty():
        raise CalibrationError(f"{text}. If it is really so, repeat the command with --yes")
    if not typer.confirm(f"{text}. Is it really so?", err=True):
        raise CalibrationError("nothing was written; put it right, and repeat the command")
