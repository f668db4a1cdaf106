"""What `rhot check` reports: problems with a severity, where they are, and what to do."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Literal, TypeVar

import msgspec

from rhot.errors import CalibrationError

T = TypeVar("T")
Severity = Literal["error", "warning", "note"]
_ORDER: tuple[Severity, ...] = ("error", "warning", "note")


class Problem(msgspec.Struct, frozen=True, kw_only=True):
    """One finding.

    error: the rig will not run as configured; warning: it will run worse than it could, or less
    safely than it should; note: worth knowing.
    """

    severity: Severity
    where: str
    what: str


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """All findings on one rig.toml, errors first."""

    config: str
    problems: list[Problem]

    def count(self, severity: Severity) -> int:
        """How many of that severity."""
        return sum(problem.severity == severity for problem in self.problems)


def report(config: str, problems: Iterable[Problem]) -> Report:
    """Errors first, else in the order found; each finding once."""
    unique = list(dict.fromkeys((p.severity, p.where, p.what) for p in problems))
    ordered = sorted(unique, key=lambda found: _ORDER.index(found[0]))
    return Report(
        config=config,
        problems=[Problem(severity=s, where=where, what=what) for s, where, what in ordered],
    )


def error(where: object, what: str) -> Problem:
    """The rig will not run as configured."""
    return Problem(severity="error", where=str(where), what=what)


def warning(where: object, what: str) -> Problem:
    """It will run, but worse or less safely."""
    return Problem(severity="warning", where=str(where), what=what)


def note(where: object, what: str) -> Problem:
    """Worth knowing."""
    return Problem(severity="note", where=str(where), what=what)


def load_or_report(load: Callable[[], T], problems: list[Problem], path: Path) -> T | None:
    """What load returns; None if the file is broken, which is a problem of the file it names."""
    try:
        return load()
    except CalibrationError as broken:
        text = str(broken)
        files = (path, path.parent / "rig.json")
        where = next((name for name in files if text.startswith(f"{name}: ")), path)
        problems.append(error(where, text.removeprefix(f"{where}: ")))
        return None
