"""`rhot grasp compare REFERENCE... --out DIR`: shapes across people, a band, markers needed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rhot.errors import CaptureError, ConfigError, writing
from services.cli.grasp.recover import FingerOption
from services.cli.options import ProgressOption

if TYPE_CHECKING:
    from services.cli.grasp.inputs import Named
    from studies.grasp.compare.comparison import Comparison
    from studies.grasp.compare.paths import TipPath


def compare(
    references: Annotated[
        list[Path],
        typer.Argument(
            metavar="REFERENCE...",
            help="recordings of healthy fingers, or folders with them: what the band is made of",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="new folder for the results")],
    judge: Annotated[
        list[Path] | None,
        typer.Option(metavar="RECORDING", help="looked at against the band; repeatable"),
    ] = None,
    accuracy: Annotated[
        float, typer.Option(min=0.1, max=90.0, help="wanted of markers, deg RMS in every joint")
    ] = 5.0,
    dot: Annotated[
        float,
        typer.Option(
            min=0.001, max=10.0, help="noise of a marker in mm, where recordings tell none"
        ),
    ] = 0.2,
    finger: FingerOption = None,
    title: Annotated[str, typer.Option(help="what stands above it")] = "Comparison of grasps",
    progress: ProgressOption = None,
) -> None:
    """Compare tip paths across people, find where one leaves their band, and count markers."""
    # Not above: matplotlib is of the extra `study`, and takes longer to import than other commands
    # take to run.
    from services.cli.grasp.inputs import load_all, made_by
    from studies.grasp.compare.write import markers_answer, write_comparison

    _check_new(out)
    named, left_out = load_all(references, finger, progress)
    known = _paths(named, left_out)
    if not known:
        raise CaptureError(f"no reference can be compared: {left_out[-1]}")
    others, more = load_all(judge, finger, progress) if judge else ([], [])
    new = _paths(others, more)
    found = _compared(known, new, dot, progress)
    left_out += more
    notes = {one.name: one.notes for one in [*known, *new] if one.notes}
    notes |= {"left out": left_out} if left_out else {}
    with writing(out):
        about = f"{made_by()} of {len(found.people)} people, {found.references} of them references."
        files = write_comparison(found, out, title, about, accuracy, notes)
    for one in left_out:
        typer.echo(f"left out: {one}", err=True)
    told = [*_told(found), markers_answer(found, accuracy), f"{files[0]}: {len(files)} files"]
    typer.echo("\n".join(told))


def _check_new(out: Path) -> None:
    """Raises ConfigError where results would mix with what is there."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"{out}: is not an empty folder; name a new one")


def _told(found: Comparison) -> list[str]:
    """The comparison in a few lines."""
    judged = [
        f"{person.someone.subject}: {100.0 * person.shape.outside_share:.0f} % of the path "
        "outside the band"
        for person in found.judged
    ]
    return [found.why_no_band or f"band of {found.references} references", *judged]


def _compared(
    known: list[TipPath], new: list[TipPath], dot_mm: float, progress: bool | None
) -> Comparison:
    """With a line of progress."""
    from services.cli.progress import Progress
    from studies.grasp.compare.comparison import compared

    line = Progress("trying markers", 0, progress, unit="sets")

    def begun(sets: int) -> Callable[[], None]:
        line.total = sets
        return line.advance

    try:
        return compared(known, new, dot_mm, begun)
    finally:
        line.end()


def _paths(named: list[Named], left_out: list[str]) -> list[TipPath]:
    """Paths of recordings that have closings; why others have none goes to left_out."""
    from rhot.errors import CaptureError
    from studies.grasp.compare.paths import tip_path

    paths = []
    for name, recording in named:
        try:
            paths.append(tip_path(name, recording))
        except CaptureError as error:
            left_out.append(str(error))
    return paths
