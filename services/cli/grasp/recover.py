"""`rhot grasp recover RECORDING... --out DIR`: joint angles from the path of the tip alone.

DIR then holds each recording as it was used, and what every method made of it, beside it:
NAME.json and NAME.recovered.json.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from services.cli.options import ProgressOption

if TYPE_CHECKING:
    from services.cli.grasp.inputs import Named
    from studies.grasp.recover.study import Settings

FingerOption = Annotated[
    Literal["index", "middle", "ring", "little", "thumb"] | None,
    typer.Option(
        metavar="index|middle|ring|little|thumb",
        help="this finger only; of a recorded hand: index, unless named",
    ),
]


def recover(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            metavar="RECORDING...",
            help="recordings of fingers, folders with them, or recordings of a hand",
        ),
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="new folder for the results")],
    part: Annotated[
        Literal["closing", "opening", "whole"],
        typer.Option(help="what is recovered; whole: every frame as it was recorded"),
    ] = "closing",
    frames: Annotated[int, typer.Option(help="frames of interest in each closing")] = 37,
    method: Annotated[
        list[str] | None, typer.Option(help="this one only; repeatable; default: all")
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(metavar="JOINT:LOW:HIGH", help="limits of a joint in degrees; repeatable"),
    ] = None,
    finger: FingerOption = None,
    progress: ProgressOption = None,
) -> None:
    """Recover joint angles from the tip's path by closed form, DLS-1, DLS-2, dls and FABRIK."""
    # Not above: numba takes longer to import than other commands take to run.
    from rhot.errors import CaptureError, ConfigError
    from services.cli.grasp.inputs import load_all
    from studies.grasp.planar import read_limit
    from studies.grasp.recover.methods import METHODS
    from studies.grasp.recover.study import Settings, check

    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"{out}: is not an empty folder; name a new one")
    limits = dict(map(read_limit, limit or []))
    settings = Settings(part, frames, tuple(method or METHODS), limits)
    check(settings)
    named, left_out = load_all(recordings, finger, progress)
    failed = _written(named, settings, out, progress)
    left_out += failed
    (out / "left_out.txt").write_text("".join(f"{one}\n" for one in left_out))
    for one in left_out:
        typer.echo(f"left out: {one}", err=True)
    if len(failed) == len(named):
        raise CaptureError(f"nothing could be recovered: {failed[-1]}")
    done = len(named) - len(failed)
    asked = len(named) + len(left_out) - len(failed)
    typer.echo(f"{out}: {done} of {asked} recovered; `rhot grasp report {out}`")


def _written(named: list[Named], settings: Settings, out: Path, progress: bool | None) -> list[str]:
    """Recover and write each recording; why some could not be."""
    import time

    from rhot.errors import CaptureError, writing
    from services.cli.progress import Progress
    from studies.grasp.recording import save_recording
    from studies.grasp.recover.report_lines import lines_of
    from studies.grasp.recover.result import SUFFIX, save_recovery
    from studies.grasp.recover.study import recover as recover_all

    line = Progress("recovering", 0, progress)
    failed: list[str] = []
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
        results = recover_all([one.recording for one in named], settings, time.perf_counter, line)
        for (name, recording), found in zip(named, results, strict=True):
            line.end()
            if isinstance(found, CaptureError):
                failed.append(f"{name}: {found}")
                continue
            save_recording(out / f"{name}.json", recording)
            save_recovery(out / f"{name}{SUFFIX}", found)
            typer.echo("\n".join(lines_of(name, found)))
    return failed
