"""`rhot calibrate hand right`: a person's bones from exercises or any motion, live or recorded.

Live, it says which exercise is due and which markers are missing; --watch asks for no exercises.
A recording that does not determine the hand is refused with the reason, and nothing is written.
Lengths measured by hand (--length) are kept as given.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
import uvloop

from rhot.errors import CalibrationError
from rhot.files.calibration import save
from rhot.hand import DIGITS, HandName
from rhot.hand_exercises import EXERCISE_S, EXERCISES
from rhot.messages import HandPoints
from services.calibrator.guided.hand_fitting import Wanted, from_either, from_exercises, from_motion
from services.calibrator.hand.free_motion.frames import GOOD_SECONDS, MIN_SECONDS
from services.cli.calibrate import options
from services.cli.calibrate.hand.exercises import follow_exercises
from services.cli.calibrate.hand.recorded import recorded
from services.cli.calibrate.hand.watch import watch_hand
from services.cli.option_groups import grouped
from services.cli.options import ConnectOption
from services.cli.router_session import rig_and_endpoints

if TYPE_CHECKING:
    from services.calibrator.output.hand_file import HandFile

_BONES = {"proximal": 0, "middle": 1, "distal": 2}
_THUMB_BONES = {"metacarpal": 0, "proximal": 1, "distal": 2}


@dataclass(frozen=True)
class SourceOptions:
    """What the hand is measured from; the exercises, live, if nothing is given."""

    recording: Annotated[
        Path | None,
        typer.Option("--from", help="a capture, a result of rhot track, points.jsonl or .mcap"),
    ] = None
    start: Annotated[
        float | None,
        typer.Option(
            min=0.0, help="with --from: second at which the exercises begin; default: found"
        ),
    ] = None
    free: Annotated[
        bool,
        typer.Option("--free", help="with --from: any motion; default: exercises, if it has them"),
    ] = False
    watch: Annotated[
        bool, typer.Option("--watch", help="live, from any motion, while somebody uses the rig")
    ] = False
    seconds: Annotated[
        float, typer.Option(min=MIN_SECONDS, max=600.0, help="with --watch: how long in view")
    ] = GOOD_SECONDS
    yes: Annotated[
        bool, typer.Option("--yes", help="with --watch: take the hand over without asking")
    ] = False


@grouped
def hand(
    which: Annotated[HandName, typer.Argument(metavar="HAND", help="left or right")] = "right",
    config: options.ConfigOption = None,
    out: options.OutOption = None,
    connect: ConnectOption = None,
    *,
    source: SourceOptions,
    length: Annotated[
        list[str] | None, typer.Option(metavar="DIGIT:BONE=MM", help="measured by hand; repeatable")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only report, write nothing")] = False,
    exercises: Annotated[bool, typer.Option("--list", help="show the exercises")] = False,
    as_json: options.JsonOption = False,
) -> None:
    """Measure a hand: follow the exercises, live, or give a recording of them or of any motion.

    With --watch, it measures itself while somebody uses the rig.
    """
    if exercises:
        for number, exercise in enumerate(EXERCISES):
            typer.echo(f"{EXERCISE_S * number:3.0f} s  {exercise.prompt}")
        return
    rig, endpoints = rig_and_endpoints(config, connect)
    known = lengths_of(length or [])
    target = options.out_folder(out, rig if config else None) / f"hand.{which}.json"
    live = f"live, rig {rig.rig.name}"
    inputs = live if source.recording is None else str(source.recording)
    wanted = Wanted(which, inputs, options.now_text(), known, source.start)
    if source.recording is not None:
        made = _of_recording(recorded(source.recording, which, config), wanted, source.free)
    elif source.watch:
        made = watch_hand(rig, endpoints, wanted, source.seconds)
        dry_run = dry_run or not (source.yes or _agreed(target))
    else:
        made = from_exercises(uvloop.run(follow_exercises(rig, endpoints, which)), wanted)
    if not dry_run:
        save(target, made)
    if as_json:
        options.echo_json(made)
        return
    _report(made, None if dry_run else target)


def _agreed(target: Path) -> bool:
    """Whether the person wants the hand; where nobody can be asked, no."""
    if not sys.stdin.isatty():
        typer.echo("nothing is written without --yes where nobody can be asked", err=True)
        return False
    replaced = f" (it replaces {target})" if target.exists() else ""
    return typer.confirm(f"take it over?{replaced}", err=True)


def _of_recording(messages: list[HandPoints], wanted: Wanted, free: bool) -> HandFile:
    """From the exercises if the recording has them, else, or if asked for, from free motion."""
    if free:
        return from_motion(messages, wanted)
    if wanted.start_s is not None:
        return from_exercises(messages, wanted)
    made, note = from_either(messages, wanted)
    if note:
        typer.echo(f"note: {note}", err=True)
    return made


def _report(made: HandFile, written: Path | None) -> None:
    from services.calibrator.output.hand_report import report_text

    typer.echo(report_text(made))
    if written is not None:
        typer.echo(f"written: {written}; fusion and solver of this rig start again with it")


def lengths_of(texts: list[str]) -> dict[tuple[int, int], float]:
    """--length index:proximal=39.5 as (digit, bone) -> metres.

    Raises CalibrationError naming what is valid.
    """
    known = {}
    for text in texts:
        name, _, value = text.partition("=")
        digit, _, bone = name.partition(":")
        bones = _THUMB_BONES if digit == "thumb" else _BONES
        try:
            millimetres = float(value)
        except ValueError:
            millimetres = -1.0
        if digit not in DIGITS or bone not in bones or not 1.0 <= millimetres <= 150.0:
            raise CalibrationError(
                f"--length {text!r}: give DIGIT:BONE=MM, e.g. index:proximal=39.5; "
                f"bones: {', '.join(bones)}; 1 to 150 mm"
            )
        known[DIGITS.index(digit), bones[bone]] = 1e-3 * millimetres
    return known
