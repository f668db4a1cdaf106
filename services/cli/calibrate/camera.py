"""`rhot calibrate camera NAME` and `rhot calibrate colors NAME`: what a camera must know before it
can see paint, from any machine.

With a running rig, pictures and results cross the bus, and the camera's tracker writes its own
files; with --video, a recording is used and the file is written here. A camera that does not
answer, and boxes or clicks that show no paint, are errors that say so; warnings do not stop it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
import uvloop

from rhot.client import RigClient
from rhot.errors import CalibrationError
from rhot.files.config import RigConfig
from rhot.messages.camera import ExposureControl
from services.cli.calibrate import options
from services.cli.calibrate.pointing_options import PointingOptions
from services.cli.option_groups import grouped
from services.cli.options import ConnectOption
from services.cli.router_session import rig_and_endpoints, router_session

Name = Annotated[str, typer.Argument(help="the camera's name in rig.toml")]


@dataclass(frozen=True)
class ExposureOptions:
    """Values of the exposure that are set by hand."""

    exposure_us: Annotated[
        float | None, typer.Option(min=1.0, max=1e6, help="exposure time in microseconds")
    ] = None
    gain: Annotated[float | None, typer.Option(min=0.01, max=64.0, help="analogue gain")] = None
    red_gain: Annotated[
        float | None, typer.Option(min=0.01, max=64.0, help="white balance: gain of red")
    ] = None
    blue_gain: Annotated[
        float | None, typer.Option(min=0.01, max=64.0, help="white balance: gain of blue")
    ] = None

    def control(self) -> ExposureControl:
        """The same as a message, 0 where not given."""
        return ExposureControl(
            exposure_us=self.exposure_us or 0.0,
            gain=self.gain or 0.0,
            red_gain=self.red_gain or 0.0,
            blue_gain=self.blue_gain or 0.0,
        )


@grouped
def camera(
    name: Name,
    config: options.ConfigOption = None,
    auto: Annotated[
        bool,
        typer.Option(
            "--auto", help="run the camera's automatics once, on what it sees now, and freeze them"
        ),
    ] = False,
    *,
    exposure: ExposureOptions,
    connect: ConnectOption = None,
) -> None:
    """Set exposure, gain and white balance of a running camera.

    Without options, show the exposure in use and what is wrong with the pictures.
    """
    by_hand = exposure.control()
    rig, endpoints = rig_and_endpoints(config, connect)
    rig.camera_named(name)
    # First what the camera finds, then what the person knows better.
    wanted = [ExposureControl(mode="auto")] if auto else []
    wanted += [by_hand] if by_hand != ExposureControl() else []
    uvloop.run(_camera(rig, endpoints, name, wanted))


async def _camera(
    rig: RigConfig, endpoints: list[str], name: str, wanted: list[ExposureControl]
) -> None:
    from services.cli.calibrate.camera_text import exposure_text, light_text
    from services.cli.calibrate.live_pictures import next_frames
    from services.pi_tracker.colors.exposure_advice import advice, assess

    async with router_session(rig.rig.name, endpoints) as bus:
        client = RigClient(bus)
        state = await client.exposure(name)
        for one in wanted:
            typer.echo(
                "running the automatics ..." if one.mode == "auto" else "setting ...", err=True
            )
            state = await client.set_exposure(name, one)
        light = assess(await next_frames(bus, name, 3))
    typer.echo(f"camera {name}: {exposure_text(state)}")
    typer.echo(light_text(light))
    if not state.adjustable:
        # Advice would name options that this camera does not have.
        return
    for line in advice(light, state.exposure_us, state.red_gain, state.blue_gain):
        typer.echo(f"warning: {line}", err=True)


@grouped
def colors(
    name: Name,
    config: options.ConfigOption = None,
    *,
    pointing: PointingOptions,
    video: Annotated[
        Path | None,
        typer.Option(help="a recording instead of the running camera: video, capture or folder"),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option(help="with --video: frames for --box, --click and --auto, e.g. 10,200,500"),
    ] = None,
    pictures: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=20,
            help="how many pictures to take; default: 5 of a hand that is held still, with --auto "
            "alone 12 of one that moves",
        ),
    ] = None,
    out: options.OutOption = None,
    picture: Annotated[
        Path | None, typer.Option(help="write a picture of what was taken for paint")
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="only report; apply nothing, write no calibration"),
    ] = False,
    connect: ConnectOption = None,
    as_json: options.JsonOption = False,
) -> None:
    """Fit colour ranges to painted markers: in the page (rhot-viewer), or by boxes, clicks or
    --auto here.
    """
    # Not above: OpenCV takes longer to import than other commands take to run.
    from services.cli.calibrate.colors import Request, from_camera, from_recording

    if not pointing:
        raise CalibrationError(
            "nothing is pointed at; give --box, --click or --auto, or use the page of rhot-viewer "
            "(tab Calibration, step Colours)"
        )
    request = Request(name, pointing, out, picture, dry_run, as_json)
    if video is not None:
        from_recording(request, options.rig_if_named(config), video, frames)
        return
    if pointing.at or frames:
        raise CalibrationError("--at and --frames name frames of a recording; give it with --video")
    rig, endpoints = rig_and_endpoints(config, connect)
    rig.camera_named(name)
    uvloop.run(from_camera(request, rig, endpoints, pictures))
