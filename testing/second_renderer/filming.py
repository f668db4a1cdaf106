"""Clips, filmed by VTK, and what the real tracker finds in the pictures.

Colours are fitted as a user does it: by clicks on paint, in some of the pictures themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rhot.files.calibration import Colors
from rhot.messages import MarkerFrame
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from testing.second_renderer.clip import SIZE_PX, Clip
from testing.second_renderer.motion import Array
from testing.second_renderer.paint import COLORS
from testing.second_renderer.pictures import Studio
from testing.second_renderer.sensor import as_i420, developed
from testing.second_renderer.window import Bytes, room_light
from testing.synthetic_points import START_NS

# As synchronisation leaves a camera's clock, by its own account.
_CLOCK_SIGMA_NS = 500_000
# Of each colour so many pictures are clicked on, where it shows by this share of its best or more;
# a click needs so many vertices of paint about it.
_CLICKS, _SHOWS, _SPOTS = 4, 0.8, 12


@dataclass
class Film:
    """What each camera took: I420 pictures at times (n,) s, shares (n, 6) of paint that shows, and
    pixels of each landmark's paint in each picture.
    """

    times_s: dict[str, Array] = field(default_factory=dict)
    pictures: dict[str, list[Bytes]] = field(default_factory=dict)
    shares: dict[str, Array] = field(default_factory=dict)
    paint_px: dict[str, list[list[Array]]] = field(default_factory=dict)


def film(clip: Clip) -> Film:
    """All pictures of a clip."""
    skinned, paint = clip.hand()
    studio = Studio(clip.play.bones, skinned, paint, clip.light)
    made = Film()
    for n, (name, camera) in enumerate(clip.rig.cameras().items()):
        room = room_light(camera, clip.light, clip.seed)
        times_s = np.arange(0.0, clip.seconds, 1.0 / clip.rig.fps) + n * clip.rig.phase_s
        made.times_s[name], made.pictures[name], made.paint_px[name] = times_s, [], []
        shares = []
        for k, at_s in enumerate(times_s.tolist()):
            taken = studio.take(camera, room, at_s, clip.shutter)
            picture = developed(taken.light, clip.sensor, (clip.seed, n, k))
            made.pictures[name].append(as_i420(picture))
            made.paint_px[name].append(taken.paint_px)
            shares.append(taken.shares)
        made.shares[name] = np.array(shares)
    studio.close()
    return made


def frame_of(clip: Clip, shots: Film, name: str, k: int) -> Frame:
    """A picture as the tracker gets it."""
    skew_ns = 1e9 * clip.rig.skew_s * (name == "right")
    stamp_ns = START_NS + round(1e9 * float(shots.times_s[name][k]) + skew_ns)
    picture = shots.pictures[name][k]
    return Frame(name, k, stamp_ns, 1e9 * clip.shutter.row_s, SIZE_PX, picture, "i420")


def fitted_colors(clip: Clip, shots: Film, name: str) -> Colors:
    """Colours of a camera by clicks on paint, in pictures in which it shows well."""
    numbers: list[int] = []
    pointers: list[Pointer] = []
    for row, color in enumerate(COLORS):
        shares = shots.shares[name][:, row]
        clear = np.flatnonzero(shares > _SHOWS * shares.max())
        for k in clear[np.linspace(0, len(clear) - 1, _CLICKS).astype(int)].tolist():
            spots = shots.paint_px[name][k][row]
            if len(spots) >= _SPOTS:
                x, y = np.median(spots, axis=0).tolist()
                pointers.append(Pointer(color, len(numbers), x, y))
                numbers.append(k)
    study = gather([frame_of(clip, shots, name, k) for k in numbers], pointers)
    return Colors(date="", tool="testing/second_renderer", colors=fit(study.samples))


def detected(clip: Clip, shots: Film) -> list[MarkerFrame]:
    """What the tracker finds, in order of exposure."""
    config = clip.config()
    found = []
    for name in ("left", "right"):
        step = step_of_rig(config, name, fitted_colors(clip, shots, name))
        skew_s = (clip.rig.skew_s + clip.rig.clock_error_s) * (name == "right")
        for k, at_s in enumerate(shots.times_s[name].tolist()):
            markers = step.step(
                frame_of(clip, shots, name, k), round(1e9 * skew_s), _CLOCK_SIGMA_NS
            )
            found.append((at_s, markers))
    return [markers for _, markers in sorted(found, key=lambda entry: entry[0])]
