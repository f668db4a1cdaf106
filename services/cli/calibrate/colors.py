"""The work of `rhot calibrate colors`: pictures and pointers in, colour ranges and a report out.

The ranges are applied to the running camera, or written to a file.
"""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import typer

from rhot.client import RigClient
from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange, Colors, load_colors, save
from rhot.files.config import RigConfig
from services.cli.calibrate import options
from services.cli.calibrate.camera_text import overlay, proposals_text, report_text
from services.cli.calibrate.live_pictures import MOVING_PAUSE_S, STILL_PAUSE_S, next_frames
from services.cli.calibrate.pointing_options import PointingOptions, frame_numbers
from services.cli.recorded.frames import frame_names, frames_by_number, spread_numbers
from services.cli.router_session import router_session
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.colors.proposal.propose import boxes_of, for_markers, propose
from services.pi_tracker.colors.report import colors_file, examine
from services.pi_tracker.identify.hand_layout import NO_LANDMARKS
from services.pi_tracker.image.frame import Frame, Image

# Pictures that --auto uses unless told otherwise, enough to tell what moves; and others.
AUTO_FRAMES, _STILL_FRAMES = 12, 5


class Pictures(NamedTuple):
    """Pictures, in the order in which pointers count them, and what warnings call them."""

    frames: Sequence[Frame]
    names: Sequence[str] = ()


@dataclass(frozen=True)
class Request:
    """What the person asks for."""

    camera: str
    pointing: PointingOptions
    out: Path | None
    picture: Path | None
    dry_run: bool
    as_json: bool


def from_recording(
    request: Request, rig: RigConfig | None, video: Path, frames: str | None
) -> None:
    """Fit to frames of a recording and write the file."""
    if request.out is None and rig is None and not request.dry_run:
        raise CalibrationError(
            "say where the result goes: --out DIR, or --config rig.toml, whose calibration folder "
            "is taken"
        )
    path = options.out_folder(request.out, rig) / f"{request.camera}.colors.json"
    numbers, pointers = request.pointing.in_single_frames()
    first = len(numbers)
    more = frame_numbers(frames) if frames else []
    if request.pointing.auto and not more:
        # What moves is told from many, also where some colours are pointed at in one.
        spread = spread_numbers(request.camera, video, AUTO_FRAMES)
        more = [number for number in spread if number not in numbers]
    numbers += more
    if not numbers:
        raise CalibrationError(
            "say which frames the boxes or clicks are in: --frames 10,200,500, "
            "or --at FRAME:color=x,y,width,height"
        )
    pointers += request.pointing.in_every_frame(range(first, len(numbers)))
    taken = frames_by_number(request.camera, video, numbers)
    inputs = {"recording": video.name, "frames": numbers}
    named = Pictures(taken, frame_names(request.camera, video, numbers))
    made = fitted(request, named, pointers, _known(path), rig, inputs)
    if not request.dry_run:
        save(path, made)
        typer.echo(f"written: {path}", err=True)


def _known(path: Path) -> dict[str, ColorRange]:
    """Ranges of other colours that are in the file already, and stay."""
    if not path.exists():
        return {}
    return load_colors(path.parent, path.name.removesuffix(".colors.json")).colors


async def from_camera(
    request: Request, rig: RigConfig, endpoints: list[str], wanted: int | None
) -> None:
    """Fit to the running camera's next pictures; apply the result there, or write it to --out.

    wanted is how many, if the person says so.
    """
    moving = not request.pointing.places
    count = wanted or (AUTO_FRAMES if moving else _STILL_FRAMES)
    pause_s = MOVING_PAUSE_S if moving else STILL_PAUSE_S
    if moving:
        seconds = round(count * pause_s + 0.5)
        typer.echo(f"move the hand about, fingers apart, for {seconds} s ...", err=True)
    async with router_session(rig.rig.name, endpoints) as bus:
        client = RigClient(bus)
        known = (await client.colors(request.camera)).colors
        taken = await next_frames(bus, request.camera, count, pause_s)
        pointers = request.pointing.in_every_frame(range(count))
        made = await asyncio.to_thread(
            fitted, request, Pictures(taken), pointers, known, rig, {"pictures": count}
        )
        if request.dry_run:
            return
        if request.out is not None:
            path = request.out / f"{request.camera}.colors.json"
            save(path, made)
            typer.echo(f"written: {path}", err=True)
            return
        await client.set_colors(request.camera, made)
    typer.echo(
        f"applied, and written to {request.camera}.colors.json on the camera's machine", err=True
    )


def fitted(
    request: Request,
    pictures: Pictures,
    pointers: list[Pointer],
    known: Mapping[str, ColorRange],
    rig: RigConfig | None,
    inputs: dict[str, Any],
) -> Colors:
    """Fit, check, print; the file to be written.

    known are the ranges there are.

    Raises CalibrationError if what is pointed at, or stands out, is no paint.
    """
    if request.pointing.auto:
        given = {pointer.color for pointer in pointers}
        pointers = pointers + _proposed(pictures.frames, rig, given, dry_run=request.dry_run)
    study = gather(pictures.frames, pointers, pictures.names)
    ranges = fit(study.samples)
    others = {name: span for name, span in known.items() if name not in ranges}
    report = examine(study, ranges, others)
    inputs = {**inputs, "places": [str(pointer) for pointer in pointers]}
    made = colors_file(
        report, ranges, others, date=options.now_text(), tool="rhot calibrate colors", inputs=inputs
    )
    if request.as_json:
        options.echo_json(made)
    else:
        typer.echo(report_text(report, ranges))
    for note in study.notes:
        typer.echo(f"note: {note}", err=True)
    for warning in report.warnings:
        typer.echo(f"warning: {warning}", err=True)
    if request.picture is not None:
        _write_picture(request.picture, overlay(study, pictures.frames, made))
    return made


def _write_picture(path: Path, image: Image) -> None:
    if not cv2.imwrite(str(path), image):
        raise CalibrationError(
            f"--picture {path} cannot be written; name a .png in a folder that exists"
        )


def _proposed(
    frames: Sequence[Frame], rig: RigConfig | None, given: Collection[str], *, dry_run: bool
) -> list[Pointer]:
    """Boxes around what stands out: of the colours that rig.toml's markers need, or all.

    given are colours that somebody points at.
    """
    wanted = rig.colors if rig else []
    proposals, suggestions = propose(frames, wanted, rig.landmarks if rig else NO_LANDMARKS)
    if not proposals:
        raise CalibrationError(
            "no patch of saturated colour stands out in these pictures; point at the markers with "
            "--box or --click"
        )
    typer.echo(proposals_text(proposals, suggestions), err=True)
    chosen, missing = for_markers(proposals, wanted)
    missing = [color for color in missing if color not in given]
    if missing and not dry_run:
        raise CalibrationError(
            f"no patch was found that could be {', '.join(missing)} of rig.toml's markers; point "
            f"at it beside --auto, in a frame of a video with --at FRAME:{missing[0]}=x,y, else "
            f"with --click {missing[0]}=x,y, or give the markers the names of what was found in "
            "rig.toml"
        )
    return [box for box in boxes_of(chosen) if box.color not in given]
