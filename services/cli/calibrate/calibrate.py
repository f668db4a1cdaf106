"""`rhot calibrate ...`: everything a rig must know about itself, each command in the file of its name; here they are gathered."""

from __future__ import annotations

import typer

from services.cli.calibrate.depth import depth
from services.cli.calibrate.eye import camera, colors
from services.cli.calibrate.hand import hand
from services.cli.calibrate.lens import lens
from services.cli.calibrate.refine import refine
from services.cli.calibrate.stereo import stereo
from services.cli.calibrate.world import world

COMMANDS = (camera, colors, lens, stereo, refine, world, depth, hand)

calibrate = typer.Typer(
    name="calibrate",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Measure lenses, the rig, the desk, ... and write calibration files.",
)
for _command in COMMANDS:
    calibrate.command(name=_command.__name__)(_command)
