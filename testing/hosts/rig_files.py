"""rig.toml and calibration of the simulated rig that the hosts of a test run.

The rig of config/sim.toml with smaller pictures at a lower rate, so that two cores carry three
computers; each camera on a host of its own, its pictures from the simulator on the master.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot.files.calibration import load_lens, save
from testing.hosts.wheels import ROOT

NAME = "hosts"
SIZE_PX, FPS = (320, 240), 15
CAMERAS = ("left", "right")
_SHIPPED_PX = (640, 480)

_RIG = """\
[rig]
name = "{name}"

[bus]
connect = ["tcp/127.0.0.1:7447", "tls/master:7448"]
listen = ["tcp/127.0.0.1:7447", "tls/0.0.0.0:7448"]
certificates = "pki"

{cameras}
[hand.right.markers]
wrist = "violet"
thumb_tip = "magenta"
index_tip = "blue"
middle_tip = "cyan"
ring_tip = "green"
little_tip = "lime"

[simulator]
scene = "piano"

[objects]
rate_hz = 30.0

[[object]]
name = "cup"
serial = "LHR-SIM00001"

[recorder]
autostart = true
"""
_CAMERA = """\
[[camera]]
name = "{name}"
source = "simulator"
host = "{name}"
fps = {fps}
size_px = [{width}, {height}]
"""


def write_rig(folder: Path) -> Path:
    """rig.toml, with calibration/ beside it, in a folder; returns the file."""
    width, height = SIZE_PX
    cameras = "\n".join(
        _CAMERA.format(name=name, fps=FPS, width=width, height=height) for name in CAMERAS
    )
    config = folder / "rig.toml"
    config.write_text(_RIG.format(name=NAME, cameras=cameras), encoding="utf-8")
    calibration = folder / "calibration"
    calibration.mkdir()
    for shipped in (ROOT / "config" / "calibration").glob("*.json"):
        (calibration / shipped.name).write_bytes(shipped.read_bytes())
    for name in CAMERAS:
        _shrink_lens(calibration, name)
    return config


def _shrink_lens(calibration: Path, camera: str) -> None:
    """The same lens before a smaller sensor; a pixel's centre is at a whole number."""
    lens = load_lens(calibration, camera)
    ratio = SIZE_PX[0] / _SHIPPED_PX[0]
    (fx, skew, cx), (_, fy, cy), last = lens.matrix
    first = (fx * ratio, skew * ratio, (cx + 0.5) * ratio - 0.5)
    second = (0.0, fy * ratio, (cy + 0.5) * ratio - 0.5)
    smaller = msgspec.structs.replace(lens, size_px=SIZE_PX, matrix=(first, second, last))
    save(calibration / f"{camera}.lens.json", smaller)
