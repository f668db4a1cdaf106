"""Clips of the second renderer through the real tracker, as cases that held_out_score.py judges.

Each clip is a recorded hand of other thickness, paint, light, room, sensor and rig. Colours are
fitted as a user does it: clicks on paint in pictures of the still hand in the same light. Fusion
and solver are given the tables' hand at a guessed size.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from rhot.files.calibration import Colors
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable
from rhot.geometry.camera import Camera, pinhole
from rhot.geometry.transforms import rotation_from_vector, transform
from rhot.hand import default_hand
from rhot.messages import MarkerFrame
from services.pi_tracker.colors.fit import fit, gather
from services.pi_tracker.colors.pointer import Pointer
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.step import TrackerStep
from testing.families.case import Case, Half
from testing.second_renderer.motion import Array, Play
from testing.second_renderer.paint import COLORS, LANDMARKS, Job, Painted, landmarks_at, painted
from testing.second_renderer.pictures import Shutter, Studio, room_light
from testing.second_renderer.room import Light
from testing.second_renderer.sensor import Sensor, as_i420, developed
from testing.second_renderer.skin import Build, Skinned, hand_mesh
from testing.synthetic_points import START_NS

SIZE_PX = (640, 480)
_CLOCK_SIGMA_NS = 500_000
_MOST_CLICKS = 4


@dataclass(frozen=True)
class Rig:
    """Two free-running cameras."""

    baseline_m: float = 0.08
    toe_in_deg: float = 2.0
    tilt_deg: float = 0.7
    fov_deg: float = 62.0
    k1: float = -0.06
    fps: float = 30.0
    phase_s: float = 0.0121
    # What the right camera's clock reads more, and how wrong its announcement is.
    skew_s: float = 0.02
    clock_error_s: float = 0.0003

    def cameras(self) -> dict[str, Camera]:
        """By name; the left one is the rig's frame."""
        found = {}
        for n, name in enumerate(("left", "right")):
            turn = np.deg2rad([n * self.tilt_deg, -n * 2.0 * self.toe_in_deg, 0.4 * n])
            place = (n * self.baseline_m, 0.001 * n, 0.002 * n)
            matrix = pinhole(SIZE_PX, np.deg2rad(self.fov_deg + 0.6 * n))
            matrix = matrix + np.array([[0, 0, 3.0 - 5.0 * n], [0, 0, 2.0 * n], [0, 0, 0]])
            distortion = np.array([self.k1, 0.012, 4e-4, -3e-4, 0.0])
            T = transform(rotation_from_vector(turn), place)
            found[name] = Camera(name, SIZE_PX, matrix, distortion, T)
        return found


@dataclass(frozen=True)
class Clip:
    """All that makes a clip; its repr says everything."""

    play: Play
    build: Build = Build()
    job: Job = Job()
    light: Light = Light()
    shutter: Shutter = Shutter()
    sensor: Sensor = Sensor()
    rig: Rig = field(default_factory=Rig)
    given_scale: float = 1.0
    seconds: float = 8.0
    seed: int = 1


def _hand(clip: Clip) -> tuple[Skinned, Painted]:
    bones = clip.play.bones(np.linspace(0.0, clip.seconds, 60))
    mesh = hand_mesh(bones, clip.build)
    return Skinned(mesh), painted(mesh, clip.job)




@dataclass
class Film:
    """What cameras took: pictures (I420) with their times, shares of paint that show, and places of
    paint in them.
    """

    times_s: dict[str, Array]
    pictures: dict[str, list[Any]]
    shares: dict[str, Array]
    paint_px: dict[str, list[list[Array]]]


def film(clip: Clip, progress: Callable[[str], None] = lambda text: None) -> Film:
    """Render all pictures of a clip."""
    skinned, paint = _hand(clip)
    studio = Studio(clip.play, skinned, paint, clip.light)
    made = Film({}, {}, {}, {})
    for n, (name, camera) in enumerate(clip.rig.cameras().items()):
        room = room_light(camera, clip.light, clip.seed)
        times_s = np.arange(0.0, clip.seconds, 1.0 / clip.rig.fps) + n * clip.rig.phase_s
        pictures, shares, places = [], [], []
        for k, at_s in enumerate(times_s.tolist()):
            taken = studio.take(camera, room, at_s, clip.shutter)
            pictures.append(as_i420(developed(taken.light, clip.sensor, (clip.seed, n, k))))
            shares.append(taken.shares)
            places.append([spots.astype(np.float32) for spots in taken.paint_px])
        made.times_s[name], made.pictures[name] = times_s, pictures
        made.shares[name], made.paint_px[name] = np.array(shares), places
        progress(name)
    return made


def kept_film(clip: Clip, folder: Path) -> Film:
    """The film of a clip, from a folder where it was made before."""
    path = folder / f"{sha256(repr(clip).encode()).hexdigest()[:16]}.pickle"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        path.write_bytes(pickle.dumps(film(clip)))
    return pickle.loads(path.read_bytes())


def frame_of(clip: Clip, shots: Film, name: str, k: int) -> Frame:
    """A picture as the tracker gets it."""
    skew_ns = 1e9 * clip.rig.skew_s * (name == "right")
    stamp_ns = START_NS + round(1e9 * float(shots.times_s[name][k]) + skew_ns)
    picture = shots.pictures[name][k]
    return Frame(name, k, stamp_ns, 1e9 * clip.shutter.row_s, SIZE_PX, picture, "i420")


def fitted_colors(clip: Clip, shots: Film, name: str) -> Colors:
    """Colours of a camera by clicks on paint, in pictures in which it shows well."""
    numbers, pointers = [], []
    shares = shots.shares[name]
    for row, color in enumerate(COLORS):
        clear = np.flatnonzero(shares[:, row] > 0.8 * shares[:, row].max())
        for k in clear[np.linspace(0, len(clear) - 1, _MOST_CLICKS).astype(int)].tolist():
            spots = shots.paint_px[name][k][row]
            if len(spots) < 12:
                continue
            x, y = np.median(spots, axis=0).tolist()
            pointers.append(Pointer(color, len(numbers), x, y))
            numbers.append(k)
    frames = [frame_of(clip, shots, name, k) for k in numbers]
    study = gather(frames, pointers)
    for note in study.notes:
        print("  note:", note)
    return Colors(date="", tool="testing/second_renderer", colors=fit(study.samples))


def config_of(clip: Clip) -> RigConfig:
    """A rig.toml for the clip."""
    markers = dict(zip(LANDMARKS, COLORS, strict=True))
    cameras = [CameraTable(name=name, fps=clip.rig.fps) for name in ("left", "right")]
    hand = HandTable(markers=markers, scale=clip.given_scale)
    return RigConfig(camera=cameras, hand={"right": hand})


def detected(clip: Clip, shots: Film) -> list[MarkerFrame]:
    """What the tracker sees, in order of exposure."""
    config = config_of(clip)
    found = []
    for name in ("left", "right"):
        colors = fitted_colors(clip, shots, name)
        step = TrackerStep(name, colors, config.tracker, SIZE_PX, config.colors)
        skew_s = (clip.rig.skew_s + clip.rig.clock_error_s) * (name == "right")
        for k in range(len(shots.pictures[name])):
            frame = frame_of(clip, shots, name, k)
            markers = step.step(frame, round(1e9 * skew_s), _CLOCK_SIGMA_NS)
            found.append((float(shots.times_s[name][k]), markers))
    return [markers for _, markers in sorted(found, key=lambda entry: entry[0])]


def clip_case(name: str, clip: Clip, folder: Path) -> Case:
    """A clip as a case."""
    shots = kept_film(clip, folder)
    frames = detected(clip, shots)
    _, paint = _hand(clip)

    @cache
    def at(time_s: float) -> Any:
        bones = clip.play.bones(np.array([time_s]))
        return landmarks_at(paint, bones.wrist[0], bones.axes[0], bones.joints[0])

    def truth(times_s: Array) -> Array:
        flat = np.asarray(times_s, dtype=np.float64).ravel().tolist()
        return np.array([at(t) for t in flat]).reshape(-1, 6, 3)

    return Case(
        name=name,
        config=config_of(clip),
        cameras=clip.rig.cameras(),
        hands={"right": default_hand("right", clip.given_scale)},
        frames=frames,
        visible=np.array([shots.shares[f.camera][f.seq] for f in frames]),
        landmarks=LANDMARKS,
        truth=truth,
        seconds=clip.seconds,
        clock_errors_s={"left": 0.0, "right": -clip.rig.clock_error_s},
    )
