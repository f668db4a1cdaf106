"""What `rhot grasp compare` does, once its options are read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import typer

from rhot.errors import CaptureError, ConfigError, writing
from services.cli.grasp.inputs import Named, load_all, made_by
from services.cli.progress import Progress
from studies.grasp.compare.comparison import Comparison, compared
from studies.grasp.compare.paths import TipPath, tip_path
from studies.grasp.compare.write import markers_answer, write_comparison
from studies.grasp.recording import Finger


class Wanted(NamedTuple):
    """The options."""

    out: Path
    accuracy_deg: float
    dot_mm: float
    finger: Finger | None
    title: str
    progress: bool | None


def compare_all(references: Sequence[Path], judge: Sequence[Path], wanted: Wanted) -> None:
    """Compare, write and say what was found. Raises ConfigError and CaptureError."""
    if wanted.out.exists() and (not wanted.out.is_dir() or any(wanted.out.iterdir())):
        raise ConfigError(f"{wanted.out}: is not an empty folder; name a new one")
    named, left_out = load_all(references, wanted.finger, wanted.progress)
    known = _paths(named, left_out)
    if not known:
        raise CaptureError(f"no reference can be compared: {left_out[-1]}")
    others, more = load_all(judge, wanted.finger, wanted.progress) if judge else ([], [])
    new = _paths(others, more)
    found = _compared(known, new, wanted)
    notes = {one.name: one.notes for one in [*known, *new] if one.notes}
    left_out += more
    if left_out:
        notes["left out"] = left_out
    with writing(wanted.out):
        about = f"{made_by()} of {len(found.people)} people, {found.references} of them references."
        files = write_comparison(found, wanted.out, wanted.title, about, wanted.accuracy_deg, notes)
    for one in left_out:
        typer.echo(f"left out: {one}", err=True)
    typer.echo(found.why_no_band or f"band of {found.references} references")
    for person in found.judged:
        outside = 100.0 * person.shape.outside_share
        typer.echo(f"{person.someone.subject}: {outside:.0f} % of the path outside the band")
    typer.echo(markers_answer(found, wanted.accuracy_deg))
    typer.echo(f"{files[0]}: {len(files)} files")


def _compared(known: list[TipPath], new: list[TipPath], wanted: Wanted) -> Comparison:
    """With a line of progress."""
    line = Progress("trying markers", 0, wanted.progress, unit="sets")

    def begun(sets: int) -> Callable[[], None]:
        line.total = sets
        return line.advance

    try:
        return compared(known, new, wanted.dot_mm, begun)
    finally:
        line.end()


def _paths(named: list[Named], left_out: list[str]) -> list[TipPath]:
    """Paths of recordings that have closings; why others have none goes to left_out."""
    paths = []
    for name, recording in named:
        try:
            paths.append(tip_path(name, recording))
        except CaptureError as error:
            left_out.append(str(error))
    return paths
