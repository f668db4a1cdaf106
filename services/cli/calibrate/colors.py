"""The work of `rhot calibrate colors`: pictures and places in, ranges and a report out, into force
or into a file.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import msgspec
import typer

from rhot.client import RigClient
from rhot.errors import CalibrationError
from rhot.files.calibration import ColorRange, Colors, load_colors, save
from rhot.files.config import RigConfig
from services.cli.calibrate import options, pictures
from services.cli.calibrate.camera_text import overlay, proposals_text, report_text
from services.cli.calibrate.pointing_options import at, everywhere, numbers_of
from services.cli.router_session import reach
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.colors.propose import boxes_of, propose
from services.pi_tracker.colors.report import colors_file, examine
from services.pi_tracker.image.frame import Frame

# Frames of a recording that --auto looks at unless told otherwise.
_AUTO_FRAMES = 6


@dataclass(frozen=True)
class Request:
    """What the person asks for."""

    camera: str
    boxes: tuple[str, ...]
    clicks: tuple[str, ...]
    at: tuple[str, ...]
    auto: bool
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
            "say where the result goes: --out DIR, or --config rig.toml, whose calibration folder is taken"
        )
    path = options.out_folder(request.out, rig) / f"{request.camera}.colors.json"
    numbers, pointers = at(request.at)
    first = len(numbers)
    numbers += numbers_of(frames) if frames else []
    if not numbers:
        if not request.auto:
            raise CalibrationError(
                "say which frames the places are in: --frames 10,200,500, or --at FRAME:color=x,y,width,height"
            )
        numbers = pictures.spread(request.camera, video, _AUTO_FRAMES)
    pointers += everywhere(request.boxes, request.clicks, range(first, len(numbers)))
    taken = pictures.recorded(request.camera, video, numbers)
    made = fitted(
        request,
        taken,
        pointers,
        _known(path),
        rig.colors if rig else [],
        {"recording": video.name, "frames": numbers},
    )
    if not request.dry_run:
        save(path, made)
        typer.echo(f"written: {path}", err=True)


def _known(path: Path) -> dict[str, ColorRange]:
    """Ranges of other colours that are in the file already, and stay."""
    return (
        load_colors(path.parent, path.name.removesuffix(".colors.json")).colors
        if path.exists()
        else {}
    )


async def from_camera(request: Request, rig: RigConfig, endpoints: list[str], count: int) -> None:
    """Fit to the running camera's next pictures, and put the result in force there (or into --out)."""
    async with reach(rig.rig.name, endpoints) as bus:
        client = RigClient(bus)
        in_force = await client.colors(request.camera)
        taken = await pictures.live(bus, request.camera, count)
        pointers = everywhere(request.boxes, request.clicks, range(count))
        made = await asyncio.to_thread(
            fitted, request, taken, pointers, in_force.colors, rig.colors, {"pictures": count}
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
        f"in force, and written to {request.camera}.colors.json on the camera's machine", err=True
    )


def fitted(
    request: Request,
    frames: Sequence[Frame],
    pointers: list[Pointer],
    known: Mapping[str, ColorRange],
    wanted: Sequence[str],
    inputs: dict[str, Any],
) -> Colors:
    """Fit, judge, print; the file to be written.

    Raises CalibrationError if what is pointed at, or stands out, is no paint.
    """
    if request.auto:
        given = {pointer.color for pointer in pointers}
        pointers = pointers + [
            box for box in _proposed(frames, wanted, request) if box.color not in given
        ]
    study = gather(frames, pointers)
    ranges = fit(study.samples)
    others = {name: span for name, span in known.items() if name not in ranges}
    report = examine(study, ranges, others)
    inputs = {**inputs, "places": [str(pointer) for pointer in pointers]}
    made = colors_file(
        report, ranges, others, date=options.now_text(), tool="rhot calibrate colors", inputs=inputs
    )
    typer.echo(
        msgspec.json.format(msgspec.json.encode(made), indent=1).decode()
        if request.as_json
        else report_text(report, ranges)
    )
    for note in study.notes:
        typer.echo(f"note: {note}", err=True)
    for warning in report.warnings:
        typer.echo(f"warning: {warning}", err=True)
    if request.picture is not None and not cv2.imwrite(
        str(request.picture), overlay(study, frames, made)
    ):
        raise CalibrationError(
            f"--picture {request.picture} cannot be written; name a .png in a folder that exists"
        )
    return made


def _proposed(frames: Sequence[Frame], wanted: Sequence[str], request: Request) -> list[Pointer]:
    proposals, suggestions = propose(frames, wanted)
    if not proposals:
        raise CalibrationError(
            "no patch of saturated colour stands out in these pictures; point at the markers with --box or --click"
        )
    typer.echo(proposals_text(proposals, suggestions), err=True)
    if not wanted:
        return boxes_of(proposals)
    missing = [color for color in wanted if color not in {one.color for one in proposals}]
    if missing and not request.dry_run:
        raise CalibrationError(
            f"no patch was found that could be {', '.join(missing)} of rig.toml's markers; point at it with --box, "
            "or give the markers the names of what was found in rig.toml"
        )
    return boxes_of([one for one in proposals if one.color in wanted])
