"""Hands with dots of one colour on their joints, rendered, with where each dot is and what shows.

The simulator's hands, skin, light and noise, through one camera; dots lie on the skin of fingers'
backs, sides or palm side, not in the middle of joints. Motions are of two halves, one to tune on.
Pure.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import dropwhile
from pathlib import Path

import msgspec
import numpy as np

from rhot.errors import CalibrationError
from rhot.files.calibration import Colors
from rhot.files.config import RigConfig, load_rig
from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, HandModel, Paint, landmark_point
from services.pi_tracker.dots.chains import finger_landmarks
from services.pi_tracker.image.frame import Frame
from services.simulator.camera.frame_source import FrameSource
from services.simulator.files.fit_colors import fit_ranges, sample_pixels
from services.simulator.render.renderer import Renderer
from services.simulator.scene.catalog import Light, SceneSpec
from services.simulator.scene.paints import SKIN, Rgb
from services.simulator.scene.scene import Scene
from testing.families.people import TABLES, Person
from testing.families.picture_motions import Moves
from testing.families.recordings import leap_hand
from testing.families.staged import staged
from testing.synthetic_points import START_NS

_RIG = Path(__file__).parents[2] / "config" / "sim.toml"
CAMERA = "left"
# Of a scene in the same light, those by which colours are calibrated.
_CALIBRATION_FRAMES = (0, 25, 50, 75, 100)
# Digit and joint of each dot: knuckle, middle joint, last joint, tip.
DOTS = {
    8: tuple((digit, joint) for digit in (0, 1) for joint in range(4)),
    15: tuple((digit, joint) for digit in range(5) for joint in (1, 2, 3)),
}

# A clip begins with a picture in which of each dot so much shows, so far from its edge, px.
_BEGINS, _EDGE_PX = 0.3, 6.0


@dataclass(frozen=True)
class DottedHand:
    """All that makes a clip; its repr says everything.

    tilt_deg, yaw_deg, roll_deg: from where the camera sees the hand; yaw 180 shows its back.
    around_deg: on which side of fingers dots are, about the bone: 0 the back, 90 its right.
    thumb_deg: the same of the thumb, beyond that: its back looks aside.
    """

    dots: int = 15
    moves: Moves = field(default_factory=Moves)
    # A Leap recording: its hand and its motion, instead of `moves` and `person`.
    recording: str = ""
    person: Person = TABLES
    diameter_mm: float = 8.0
    around_deg: float = 0.0
    thumb_deg: float = 70.0
    tilt_deg: float = 20.0
    yaw_deg: float = 180.0
    roll_deg: float = 0.0
    distance_m: float = 0.45
    light: Light = field(default_factory=Light)
    skin: Rgb = SKIN.albedo
    color: str = "magenta"
    exposure_s: float = 0.008
    noise: float = 5.0
    seconds: float = 5.0
    seed: int = 1

    @property
    def landmarks(self) -> list[str]:
        """Of each dot."""
        return [finger_landmarks(DIGITS[digit])[joint] for digit, joint in DOTS[self.dots]]

    def hand(self) -> HandModel:
        """The hand with its dots."""
        model = leap_hand(self.recording).model if self.recording else self.person.model()
        paint = dict(model.paint)
        for (digit, joint), name in zip(DOTS[self.dots], self.landmarks, strict=True):
            turn = np.deg2rad(self.around_deg + (self.thumb_deg if digit == 0 else 0.0))
            radius = model.digits[digit].radii_m[joint]
            # A finger ends at its tip joint: there the dot is on the nail, a radius before it.
            back = min(radius, model.digits[digit].lengths_m[2]) if joint == 3 else 0.0
            at = (radius * float(np.sin(turn)), radius * float(np.cos(turn)), back)
            paint[name] = Paint(offset_m=at, radius_m=0.0, extent_m=1e-3 * self.diameter_mm)
        return msgspec.structs.replace(model, paint=paint)

    def config(self) -> RigConfig:
        """One camera of sim.toml, and a hand that has dots only."""
        config = load_rig(_RIG)
        table = msgspec.structs.replace(
            config.hand["right"], markers=dict.fromkeys(self.landmarks, self.color)
        )
        cameras = [camera for camera in config.camera if camera.name == CAMERA]
        return msgspec.structs.replace(
            config, camera=cameras, hand={self.hand().hand: table}, object=[]
        )

    def scene(self, seed: int = 0) -> Scene:
        """The scene; seed: of another one in the same light, 0: of this one."""
        spec = SceneSpec(
            "still",
            "a case of testing/families",
            distance_m=self.distance_m,
            tilt_deg=self.tilt_deg,
            yaw_deg=self.yaw_deg,
            roll_deg=self.roll_deg,
            exposure_s=self.exposure_s,
            noise=self.noise,
            light=self.light,
            skin=self.skin,
        )
        motion = self.recording or self.moves
        return staged(self.config(), spec, self.hand(), motion, seed or self.seed)


@dataclass(frozen=True, eq=False)
class DottedPicture:
    """A picture, where each dot is (d, 2) px and how much of it shows (d,), against one that faces
    the camera; radius: of a dot that does, on average, px.
    """

    frame: Frame
    places: Array
    visible: Array
    radius: float


def colors_of(clip: DottedHand) -> Colors:
    """Colour ranges as somebody calibrates them who holds the hand still in the light of a clip."""
    still = dataclasses.replace(clip, moves=Moves("still"), recording="")
    renderer = Renderer(still.scene(seed=clip.seed + 1000), CAMERA)
    by_surface, other = sample_pixels(renderer, _CALIBRATION_FRAMES)
    dots = [by_surface[surface] for surface in renderer.shapes.paint_surfaces.values()]
    return fit_ranges({clip.color: np.concatenate(dots)}, other, "", "testing/families")


# What hands do: a gesture and a path that they are carried along, or a Leap recording's name.
_MOTIONS: dict[str, dict[str, Moves | str]] = {
    "tuning": {
        "fist": Moves("fist"),
        "wave": Moves("wave"),
        "pinch": Moves("pinch"),
        "Leap splay": "HandSplay-110fps",
        "Leap wave": "wave",
        "Leap grab": "grab",
    },
    "held out": {
        "piano": Moves("piano"),
        "fist, turning": Moves("fist", "roll", 25.0, 0.5),
        "pinch, flapping": Moves("pinch", "flap", 20.0, 1.0),
        "wandering, stop and go": Moves("random", "stop_and_go", 8.0),
        "Leap pinch": "pinch",
    },
}
HALVES = tuple(_MOTIONS)
# Lightly tanned, dark, pale.
_SKINS: tuple[Rgb, ...] = (SKIN.albedo, (0.16, 0.085, 0.055), (0.72, 0.47, 0.37))


def clips(half: str, dots: int, count: int, part: str = "") -> Iterator[tuple[str, DottedHand]]:
    """Clips of one of HALVES, so many of each motion whose name has this part, with that name.

    People, sides that the hand is seen from, dots and skin differ. Those that never show all dots
    at once are left out.
    """
    for number, (name, motion) in enumerate(_MOTIONS[half].items()):
        found = 0 if part in name else count
        for seed in range(20 * HALVES.index(half), 20 * HALVES.index(half) + 20):
            one = _clip(motion, dots, seed, number)
            if found < count and _can_begin(one):
                found += 1
                yield name, one


def _clip(motion: Moves | str, dots: int, seed: int, number: int) -> DottedHand:
    random = np.random.default_rng([seed, dots, number])
    # Dots are on the back, or on the palm's side, and the camera is there; thumb and index finger
    # may be seen from the thumb's side.
    palm = 180.0 * float(random.random() < 0.3)
    few = dots == 8
    yaw_deg = random.uniform(100.0, 190.0) if few else 180.0 - palm + random.uniform(-30.0, 30.0)
    around_deg = random.uniform(-50.0, 0.0) if few else palm + random.uniform(-20.0, 20.0)
    return DottedHand(
        dots=dots,
        moves=Moves() if isinstance(motion, str) else motion,
        recording=motion if isinstance(motion, str) else "",
        person=Person(seed=seed + 1),
        diameter_mm=random.uniform(6.0, 9.0),
        around_deg=around_deg,
        thumb_deg=random.uniform(20.0, 70.0) if few else 70.0,
        tilt_deg=random.uniform(0.0, 35.0),
        yaw_deg=yaw_deg,
        roll_deg=random.uniform(-30.0, 30.0),
        distance_m=random.uniform(0.28, 0.42),
        skin=_SKINS[seed % len(_SKINS)],
        seed=seed + 1,
    )


def _can_begin(clip: DottedHand) -> bool:
    """Whether its colour can be calibrated, and enough pictures follow one that shows all dots."""
    try:
        colors_of(clip)
    except CalibrationError:
        return False
    enough = int(0.5 * clip.seconds * clip.config().camera[0].fps)
    return sum(1 for _ in pictures_of(clip)) > enough


def pictures_of(clip: DottedHand) -> Iterator[DottedPicture]:
    """All pictures of a clip from the first that shows all dots."""
    return dropwhile(lambda picture: not _shows_all(picture), _all_pictures(clip))


def _shows_all(picture: DottedPicture) -> bool:
    furthest = np.array(picture.frame.size_px) - _EDGE_PX
    inside = (picture.places > _EDGE_PX) & (picture.places < furthest)
    return bool(picture.visible.min() >= _BEGINS and inside.all())


def _all_pictures(clip: DottedHand) -> Iterator[DottedPicture]:
    scene = clip.scene()
    (hand,) = scene.hands.values()
    model, names = clip.hand(), clip.landmarks
    source = FrameSource(scene, CAMERA, recorded=True)
    camera, renderer = source.camera, source.renderer
    surfaces = [renderer.shapes.paint_surfaces[hand.name, name] for name in names]
    for seq in range(int(clip.seconds * scene.config.camera[0].fps)):
        taken = source.take(seq, START_NS)
        if taken.image is None:
            continue
        labels = renderer.labels(taken.time_s)
        joints = hand.joints(hand.state_at(taken.time_s))
        points = np.array([landmark_point(model, name, *joints) for name in names])
        places = camera.project(points)
        depths = (points - camera.centre_rig) @ camera.T_camera_from_rig[2, :3]
        radii = camera.focal_px[0] * 0.5e-3 * clip.diameter_mm / depths
        counts = np.zeros(len(names))
        for k, surface in enumerate(surfaces):
            rows, columns = np.nonzero(labels == 1 + surface)
            counts[k] = len(rows)
            if len(rows):
                places[k] = columns.mean(), rows.mean()
        frame = Frame(
            taken.camera,
            taken.seq,
            taken.stamp_ns,
            taken.row_time_ns,
            taken.size_px,
            taken.image,
            "i420",
            full_range=False,
        )
        visible = np.minimum(counts / (np.pi * radii**2), 1.0)
        yield DottedPicture(frame, places, visible, float(radii.mean()))
