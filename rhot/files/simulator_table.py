"""The [simulator] table of rig.toml: a rig that is not there.

Every key with its type, bounds, default and reason, as in rig_tables.py.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from rhot.files.rig_tables import NonNegative, Table


class Simulator(Table, frozen=True, kw_only=True):
    """What is seen, how its pictures are spoilt, and what its trackers get wrong."""

    # What simulated cameras see; `rhot simulate --list` names the scenes.
    scene: str = "piano"
    # Instead of a scene, a recorded hand that goes to and fro: a file as `rhot simulate --motion`
    # takes it, with bones that fit; relative to this file. Empty: the scene.
    motion: str = ""
    # Of a recorded hand from the cameras.
    motion_distance_m: Annotated[float, msgspec.Meta(ge=0.1, le=3.0)] = 0.5
    # Of noise, paint and the room: the same seed gives the same pictures.
    seed: Annotated[int, msgspec.Meta(ge=0)] = 1
    # Of the motion, against the hand's own.
    speed: Annotated[float, msgspec.Meta(gt=0.0, le=10.0)] = 1.0
    # What a Pi's camera does to its pictures by default and rhot switches off, to see what it
    # costs: sharpening (libcamera's Sharpness; a Pi's default is 1) and denoising (share of the
    # denoised picture; a Pi's tuning files say 0.75).
    sharpen: Annotated[float, msgspec.Meta(ge=0.0, le=16.0)] = 0.0
    denoise: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.0
    # Pictures go through JPEG of this quality, as webcams send them; 0: they do not.
    jpeg: Annotated[int, msgspec.Meta(ge=0, le=100)] = 0
    # Live pictures with Y in 0..255 instead of 16..235.
    full_range: bool = False
    # Jitter of the simulated Vive trackers, of daily use; a laser tracker's study: 5.65 mm RMS.
    tracker_noise_m: Annotated[float, msgspec.Meta(ge=0.0, le=0.1)] = 1e-3
    # Of their turn.
    tracker_noise_deg: Annotated[float, msgspec.Meta(ge=0.0, le=20.0)] = 0.3
    # Share of their poses that are 20 to 200 mm off.
    tracker_outliers: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.0
    # Share of the time in which a tracker is out of the base stations' sight, 0.4 s at a time.
    tracker_dropouts: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)] = 0.0
    # How much later than their instants the trackers' stamps are.
    tracker_late_ms: Annotated[float, msgspec.Meta(ge=-500.0, le=500.0)] = 0.0
    # Somebody moves the base stations after so many seconds, by so much: is it noticed?
    lighthouse_moves_s: NonNegative = 0.0
    lighthouse_shift_m: Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)] = 0.0
    lighthouse_turn_deg: Annotated[float, msgspec.Meta(ge=-90.0, le=90.0)] = 0.0
