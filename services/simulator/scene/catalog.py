"""The named scenes: which motion, where, in which light. Pure data.

A new scene is a row of SCENES. An unknown name is a ConfigError with the valid ones.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from rhot.errors import ConfigError
from rhot.hand import HandName
from services.simulator.scene.paints import SKIN, Rgb

Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Light:
    """Directions point from the hand to the light, in the frame of the first camera.

    Colours are linear RGB.
    """

    key_from: Vec3 = (-0.45, -0.75, -0.55)
    key: Rgb = (0.86, 0.83, 0.78)
    fill_from: Vec3 = (0.8, -0.1, -0.5)
    fill: Rgb = (0.16, 0.17, 0.19)
    ambient: Rgb = (0.30, 0.30, 0.31)
    # A coloured lamp from the side whose light the skin reflects: RHOT section 9.1.
    rim_from: Vec3 = (0.9, 0.3, 0.2)
    rim: Rgb = (0.0, 0.0, 0.0)
    # Lamps on the mains: their light swings by this share to either side, this often a second.
    flicker: float = 0.0
    flicker_hz: float = 100.0


@dataclass(frozen=True)
class SweepSpec:
    """How the first object is moved and turned through the volume, by an arm nobody sees.

    reach is how far to either side and up and down, as a share of the depth; depth_m is nearest
    and farthest; turn_deg to either side about x, y and z of its tracker.
    """

    # Pictures end at 0.6 and 0.45 of the depth.
    reach: tuple[float, float] = (0.36, 0.28)
    depth_m: tuple[float, float] = (0.34, 0.76)
    turn_deg: Vec3 = (60.0, 60.0, 60.0)


@dataclass(frozen=True)
class SceneSpec:
    """What makes a scene.

    Lengths in metres, angles in degrees, in the frame of the first camera.
    """

    motion: str
    about: str
    # The middle of the hand, in front of the middle of the rig.
    distance_m: float = 0.5
    shift_m: tuple[float, float] = (0.0, 0.0)
    # The cameras see the palm from this far on the wrist's side, so that the painted tips stay in
    # view as the fingers curl.
    tilt_deg: float = 38.0
    yaw_deg: float = 8.0
    roll_deg: float = -6.0
    # How the hand moves about as a whole: amplitudes and frequency.
    travel_m: Vec3 = (0.0, 0.0, 0.0)
    travel_hz: float = 0.3
    speed: float = 1.0
    # Mid exposure of an indoor webcam; 1/125 s.
    exposure_s: float = 0.008
    # Standard deviation of each colour channel in grey levels at mid-grey.
    noise: float = 4.5
    # Standard deviation of lens blur and defocus at the hand, px.
    blur_px: float = 0.6
    light: Light = Light()
    # Albedo of the skin.
    skin: Rgb = SKIN.albedo
    # How unevenly tips are painted: the share of its length by which an edge leans.
    uneven: float = 0.0
    # Objects in saturated colours in the background.
    clutter: bool = False
    # Of "grab": the hand closes about the object this far from it, and leaves it where it is.
    pass_by_m: float = 0.0
    # The first object's way, if it does not wait for a hand; the scene has no hands then.
    sweep: SweepSpec | None = None
    # Hands beside the configured ones, unpainted.
    extra_hands: tuple[HandName, ...] = ()


SCENES: dict[str, SceneSpec] = {
    "fist": SceneSpec(
        "fist", "the finger study's palmar grasp: 2 s closing, 2 s opening", tilt_deg=50.0
    ),
    "pinch": SceneSpec("pinch", "thumb and index finger meet and part"),
    "wave": SceneSpec("wave", "the open hand waves", tilt_deg=20.0),
    "piano": SceneSpec("piano", "the fingers strike one after the other", tilt_deg=32.0),
    # From here cameras see tips that have closed about a cup of any size at 97 % of the instants;
    # from further on the wrist's side (30 deg) the index finger's at 43 %.
    "grab": SceneSpec(
        "grab",
        "the hand takes an object, carries it about and puts it back",
        tilt_deg=0.0,
        # Towards the tracker: its bead is not half hidden by it, which shifts it by 6 px.
        yaw_deg=-20.0,
    ),
    "random": SceneSpec("random", "all joints wander through their ranges", tilt_deg=42.0),
    "still": SceneSpec("still", "an open hand held still", tilt_deg=20.0),
    "guided": SceneSpec(
        "guided", "the exercises of `rhot calibrate hand`, with its timing (48 s)", tilt_deg=42.0
    ),
    "hard": SceneSpec(
        "random",
        "fast motion, blur, coloured clutter, coloured light on the skin, more noise",
        tilt_deg=42.0,
        travel_m=(0.09, 0.05, 0.06),
        travel_hz=0.7,
        speed=1.6,
        exposure_s=0.012,
        noise=6.0,
        blur_px=0.8,
        light=Light(rim=(0.50, 0.05, 0.42), key=(0.74, 0.71, 0.68)),
        clutter=True,
    ),
    "two_hands": SceneSpec(
        "piano",
        "both hands; one that is not configured is unpainted",
        tilt_deg=30.0,
        extra_hands=("left", "right"),
    ),
    "pass_by": SceneSpec(
        "grab",
        "the hand closes 10 mm beside an object, and never touches it",
        tilt_deg=0.0,
        yaw_deg=-20.0,
        pass_by_m=0.010,
    ),
    "registration": SceneSpec(
        "", "the first object, moved and turned for `rhot calibrate objects`", sweep=SweepSpec()
    ),
    "registration_unturned": SceneSpec(
        "",
        "the same without turning: not enough for `rhot calibrate objects`",
        sweep=SweepSpec(turn_deg=(0.0, 0.0, 0.0)),
    ),
    "registration_flat": SceneSpec(
        "",
        "the same in one plane: not enough either",
        sweep=SweepSpec(depth_m=(0.5, 0.5), turn_deg=(0.0, 0.0, 60.0)),
    ),
}


# Other words for the same scene.
ALSO = {"grasp": "grab"}


def scene_spec(name: str) -> SceneSpec:
    """The scene of that name.

    Raises ConfigError listing the valid names.
    """
    name = ALSO.get(name, name)
    if name not in SCENES:
        near = difflib.get_close_matches(name, SCENES, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise ConfigError(
            f"no scene {name!r}; {hint}valid: {', '.join([*SCENES, *ALSO])};"
            " set it in [simulator] of rig.toml or on the command line"
        )
    return SCENES[name]
