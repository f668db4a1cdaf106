"""`rhot calibrate ...`: everything a rig must know about itself.

Each command is in the file of its name; colors is in camera.py, stereo and world are in rig.py,
objects has a room.
"""

from __future__ import annotations

from services.cli.calibrate.camera import camera, colors
from services.cli.calibrate.depth import depth
from services.cli.calibrate.hand.command import hand
from services.cli.calibrate.lens import lens
from services.cli.calibrate.objects.command import objects
from services.cli.calibrate.refine import refine
from services.cli.calibrate.rig import stereo, world
from services.cli.options import menu

COMMANDS = (camera, colors, lens, stereo, refine, world, depth, hand, objects)

calibrate = menu("calibrate", "Measure lenses, the rig, the desk, ... and write calibration files.")
for _command in COMMANDS:
    calibrate.command(name=_command.__name__)(_command)
