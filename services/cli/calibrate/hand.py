"""`rhot calibrate hand right`: a person's bone lengths from a short guided recording, live from the
rig or from a file.

Live, it says which exercise is due and which markers are missing. A recording that does not
determine the hand is refused with the reason, and nothing is written. Lengths measured by hand
(--length) are kept as given.
"""

from __future__ import annotations

import asyncio
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
import uvloop

from rhot import topics
from rhot.client import RigClient
from rhot.errors import CalibrationError, CaptureError
from rhot.files.calibration import save
from rhot.files.config import RigConfig
from rhot.hand import BASIC_LANDMARKS, DIGITS, HANDS, HandName, default_hand
from rhot.hand_exercises import CYCLE_S, EXERCISE_S, EXERCISES
from rhot.messages import HandPoints
from services.cli.calibrate import options
from services.cli.options import ConnectOption
from services.cli.recorded_messages import messages as messages_of
from services.cli.router_session import rig_and_endpoints, router_session
from services.cli.terminal import Terminal

if TYPE_CHECKING:
    from services.calibrator.output.hand_file import HandFile

_BONES = {"proximal": 0, "middle": 1, "distal": 2}
_THUMB_BONES = {"metacarpal": 0, "proximal": 1, "distal": 2}
# Time to read the first exercise and bring the hand into view.
_READY_S = 3.0
# So long without a message from fusion nobody need go on.
_SILENT_S = 5.0


def hand(
    which: Annotated[HandName, typer.Argument(metavar="HAND", help="left or right")] = "right",
    recording: Annotated[
        Path | None,
        typer.Option("--from", help="a capture, a result of rhot track, points.jsonl or .mcap"),
    ] = None,
    config: options.ConfigOption = None,
    out: options.OutOption = None,
    connect: ConnectOption = None,
    start: Annotated[
        float | None,
        typer.Option(
            min=0.0, help="with --from: second at which the exercises begin; default: found"
        ),
    ] = None,
    length: Annotated[
        list[str] | None, typer.Option(metavar="DIGIT:BONE=MM", help="measured by hand; repeatable")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only report, write nothing")] = False,
    exercises: Annotated[bool, typer.Option("--list", help="show the exercises")] = False,
    as_json: options.JsonOption = False,
) -> None:
    """Measure a hand from a guided recording: follow the exercises, live, or give a recording of
    them.
    """
    if exercises:
        for number, exercise in enumerate(EXERCISES):
            typer.echo(f"{EXERCISE_S * number:3.0f} s  {exercise.prompt}")
        return
    known = lengths_of(length or [])
    rig, endpoints = rig_and_endpoints(config, connect)
    if recording is None:
        messages, source = uvloop.run(_live(rig, endpoints, which)), f"live, rig {rig.rig.name}"
    else:
        messages, source = recorded(recording, which, config), str(recording)
    made = _fit(messages, which, start, known, source)
    target = options.out_folder(out, rig if config else None) / f"hand.{which}.json"
    if not dry_run:
        save(target, made)
    if as_json:
        options.echo_json(made)
        return
    _report(made, None if dry_run else target)


def _fit(
    messages: list[HandPoints],
    which: HandName,
    start_s: float | None,
    known: dict[tuple[int, int], float],
    source: str,
) -> HandFile:
    from services.calibrator.hand.fit import fit_hand
    from services.calibrator.hand.recording import sort_exercises
    from services.calibrator.output.hand_file import hand_file

    if not messages:
        raise CalibrationError(
            f"{source}: has no points of a {which} hand; are the cameras calibrated and the "
            "markers in rig.toml?"
        )
    table = default_hand(which)
    problem, found = fit_hand(sort_exercises(messages, table, start_s=start_s), table, known)
    return hand_file(problem, found, table, date=options.now_text(), inputs=source)


def _report(made: HandFile, written: Path | None) -> None:
    from services.calibrator.output.hand_report import report_text

    typer.echo(report_text(made))
    if written is not None:
        typer.echo(
            f"written: {written}; running services read it when they start: "
            "restart rhot-fusion and rhot-solver"
        )


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


def recorded(path: Path, which: HandName, config: Path | None) -> list[HandPoints]:
    """The points of one hand in a recording of any kind.

    Raises CaptureError if there is none, and what reading it raises.
    """
    if path.is_file() or (path / "points.jsonl").is_file():
        found = list(messages_of(path, topics.POINTS, HandPoints, "points"))
    elif (path / "rig.toml").is_file():
        from services.cli.offline.inputs import job_of
        from services.cli.offline.run import run

        with tempfile.TemporaryDirectory() as folder:
            tracked = Path(folder) / "out"
            run(job_of([str(path)], config), tracked, None)
            found = list(messages_of(tracked, topics.POINTS, HandPoints, "points"))
    else:
        raise CaptureError(f"{path}: is no capture, result of `rhot track`, points.jsonl or .mcap")
    return [message for message in found if message.hand == which]


async def _live(rig: RigConfig, endpoints: list[str], which: HandName) -> list[HandPoints]:
    """One pass through the exercises, with what to do now and what is missing on standard error."""
    if which not in rig.hand:
        others = ", ".join(hand for hand in HANDS if hand in rig.hand) or "no hand"
        raise CalibrationError(f"rig.toml has no [hand.{which}.markers]; it has {others}")
    teller, messages, shown = Terminal(), [], -1
    async with router_session(rig.rig.name, endpoints) as bus:
        stream = RigClient(bus).hand_points(which, queue=256)
        teller.line(
            f"{CYCLE_S:.0f} s of exercises begin in {_READY_S:.0f} s: {EXERCISES[0].prompt}"
        )
        await asyncio.sleep(_READY_S)
        began_s = time.monotonic()
        while (passed_s := time.monotonic() - began_s) < CYCLE_S:
            try:
                message = await asyncio.wait_for(anext(stream), _SILENT_S)
            except TimeoutError:
                raise CalibrationError(
                    f"no points of the {which} hand for {_SILENT_S:.0f} s: is fusion running and "
                    "the hand in view? `rhot top` shows it"
                ) from None
            messages.append(message)
            number = min(int(passed_s // EXERCISE_S), len(EXERCISES) - 1)
            if number != shown:
                shown = number
                missing = _missing(message)
                note = f"  (not seen: {missing})" if missing else ""
                teller.line(f"{number + 1:2}/{len(EXERCISES)}  {EXERCISES[number].prompt}{note}")
    return messages


def _missing(message: HandPoints) -> str:
    seen = {point.name for point in message.points if point.source == "measured"}
    return ", ".join(name for name in BASIC_LANDMARKS if name not in seen)
