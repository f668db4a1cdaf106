"""rig.toml, the one file people write: strict, frozen, with errors that name file, field and
allowed values.

Calibration results live in other files (rhot/files/calibration.py) and are never touched from here.
A missing table means its defaults; an unknown table or key is an error, with the nearest valid
name.
"""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from rhot.errors import ConfigError
from rhot.files.config_errors import explain
from rhot.hand import HANDS, LANDMARKS
from rhot.messages import Name
from rhot.topics import Rate

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Pixels = Annotated[int, msgspec.Meta(ge=16, le=8192)]


class Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of every TOML table."""


class Rig(Table, frozen=True, kw_only=True):
    name: Name = "desk"
    # Folder of calibration/*.json, relative to rig.toml.
    calibration: str = "calibration"


class Bus(Table, frozen=True, kw_only=True):
    # Where services find the router (they are its clients).
    connect: tuple[str, ...] = ("tcp/127.0.0.1:7447",)
    # Where the router of `rhot router`, `rhot up` and `rhot demo` listens.
    listen: tuple[str, ...] = ("tcp/127.0.0.1:7447",)


class CameraTable(Table, frozen=True, kw_only=True):
    name: Name
    # picamera2[:N], v4l2:N or v4l2:/dev/..., video:FILE, folder:DIR, capture:DIR, simulator.
    source: str = "picamera2"
    fps: Annotated[float, msgspec.Meta(gt=0.0, le=240.0)] = 30.0
    size_px: tuple[Pixels, Pixels] = (640, 480)
    # libcamera's software synchronisation (picamera2 only): one "server", the others "client", all
    # with the same fps, expose together.
    sync: Literal["off", "server", "client"] = "off"
    # Host that runs this camera's tracker; empty: the machine of `rhot up`.
    host: str = ""


class Tracker(Table, frozen=True, kw_only=True):
    # "lut": chroma lookup tables on YUV420; "paper": the RHOT paper's HSV pipeline, for comparison.
    method: Literal["lut", "paper"] = "lut"
    # RHOT, section 9.1: 40 px gave the most consistent tracking.
    roi_margin_px: Annotated[int, msgspec.Meta(ge=0, le=500)] = 40
    # The lens's distortion taken out of whole pictures, as the RHOT paper did at first; needs
    # <camera>.lens.json. For comparison: it costs time, and fusion takes it out of the markers'
    # positions anyway.
    rectify: bool = False
    # Gaussian kernel (odd, 0 = off) and erode / dilate rounds, on the mask.
    gaussian_px: Annotated[int, msgspec.Meta(ge=0, le=31)] = 3
    erode: Annotated[int, msgspec.Meta(ge=0, le=10)] = 1
    dilate: Annotated[int, msgspec.Meta(ge=0, le=10)] = 1
    min_area_px: NonNegative = 12.0
    max_area_px: Positive = 20_000.0


class OneEuro(Table, frozen=True, kw_only=True):
    """Casiez, Roussel, Vogel, "1 Euro Filter", CHI 2012."""

    # Of all pairs that halve the jitter of a resting hand (1 mm at 30 Hz), these follow a hand at
    # 0.15-0.5 m/s best: benchmarks/filters.py.
    mincutoff_hz: Positive = 1.2
    # Hz per m/s.
    beta: NonNegative = 170.0
    dcutoff_hz: Positive = 1.0


class Disparity(Table, frozen=True, kw_only=True):
    """RHOT eq. (9), D = k * x^z with D in cm and x in px, and the alignment angle of eq. (10)."""

    k: Positive = 4543.3
    z: Annotated[float, msgspec.Meta(ge=-3.0, le=-0.1)] = -1.035
    phi_rad: Annotated[float, msgspec.Meta(ge=-0.5, le=0.5)] = 0.0
    # "power": eq. (9) with k and z above; "geometry": z = -1 and k from eq. (10) with baseline,
    # field of view and phi_rad.
    law: Literal["power", "geometry"] = "power"


class Fusion(Table, frozen=True, kw_only=True):
    # "kalman": every observation at its own instant; "triangulate" and "disparity": pair the views
    # first.
    method: Literal["kalman", "triangulate", "disparity"] = "kalman"
    # How paired methods bring views to one instant.
    pairing: Literal["hermite", "linear", "nearest"] = "hermite"
    filter: Literal["one_euro", "none"] = "one_euro"
    # Instants a result waits for later observations, in frames of the fastest camera.
    lag_frames: Annotated[int, msgspec.Meta(ge=0, le=2)] = 0
    # A landmark not seen by two cameras is carried on this long, then dropped.
    hold_s: Annotated[float, msgspec.Meta(ge=0.0, le=2.0)] = 0.15
    # Working volume in front of the cameras; points outside it are mismatches. RHOT section 6: 100
    # x 100 x 100 cm.
    max_distance_m: Positive = 2.0
    # Learn what is left of the cameras' clock errors from the markers' motion (epipolar residual
    # against image speed).
    tune_clocks: bool = True
    one_euro: OneEuro = OneEuro()
    disparity: Disparity = Disparity()


class Solver(Table, frozen=True, kw_only=True):
    method: Literal["dls", "fabrik", "analytic", "dls-paper", "fabrik-paper"] = "dls"
    max_iterations: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 60
    tolerance_m: Positive = 1e-4


class ObjectTable(Table, frozen=True, kw_only=True):
    name: Name
    serial: Name


class Objects(Table, frozen=True, kw_only=True):
    # steamvr, libsurvive, replay:FILE, simulator, or network (poses arrive on the bus from
    # elsewhere).
    source: str = "simulator"
    rate_hz: Annotated[float, msgspec.Meta(gt=0.0, le=1000.0)] = 90.0


class HandTable(Table, frozen=True, kw_only=True):
    # landmark -> colour
    markers: dict[str, Name]
    # Size against the average adult until `rhot calibrate hand` has measured it.
    scale: Annotated[float, msgspec.Meta(ge=0.4, le=1.6)] = 1.0


class Simulator(Table, frozen=True, kw_only=True):
    scene: str = "piano"
    seed: Annotated[int, msgspec.Meta(ge=0)] = 1
    speed: Annotated[float, msgspec.Meta(gt=0.0, le=10.0)] = 1.0


class Viewer(Table, frozen=True, kw_only=True):
    host: Literal["127.0.0.1", "localhost"] = "127.0.0.1"
    port: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 8080
    rate_hz: Annotated[float, msgspec.Meta(gt=0.0, le=60.0)] = 30.0


class Recorder(Table, frozen=True, kw_only=True):
    folder: str = "recordings"
    autostart: bool = False


class World(Table, frozen=True, kw_only=True):
    """Turns the rig frame away from the first camera: T_rig_from_camera as 4x4 rows, metres."""

    T_rig_from_camera: tuple[
        tuple[float, float, float, float],
        tuple[float, float, float, float],
        tuple[float, float, float, float],
        tuple[float, float, float, float],
    ]


class RigTable(Rig, frozen=True, kw_only=True):
    world: World | None = None


class RigConfig(Table, frozen=True, kw_only=True):
    """All of rig.toml. `folder` is where it was read from; relative paths start there."""

    rig: RigTable = RigTable()
    bus: Bus = Bus()
    camera: list[CameraTable] = []
    tracker: Tracker = Tracker()
    hand: dict[Literal["left", "right"], HandTable] = {}
    fusion: Fusion = Fusion()
    solver: Solver = Solver()
    objects: Objects = Objects()
    object: list[ObjectTable] = []
    simulator: Simulator = Simulator()
    viewer: Viewer = Viewer()
    recorder: Recorder = Recorder()
    folder: str = "."

    @property
    def calibration_dir(self) -> Path:
        """Folder of calibration/*.json."""
        return Path(self.folder) / self.rig.calibration

    def camera_named(self, name: str) -> CameraTable:
        """The [[camera]] table of that name."""
        for camera in self.camera:
            if camera.name == name:
                return camera
        raise ConfigError(
            f"rig {self.rig.name!r} has no camera {name!r}; "
            f"it has {[c.name for c in self.camera]}. Add a [[camera]] table to rig.toml"
        )

    @property
    def colors(self) -> list[str]:
        """Every colour some hand's marker uses."""
        return sorted({color for hand in self.hand.values() for color in hand.markers.values()})

    def rate_hz(self, rate: Rate, camera: str | None = None) -> float:
        """Expected rate of a stream; 0 where there is none."""
        fastest = max((c.fps for c in self.camera), default=0.0)
        match rate:
            case Rate.CAMERA:
                return self.camera_named(camera).fps if camera else fastest
            case Rate.HAND:
                return fastest
            case Rate.OBJECT:
                return self.objects.rate_hz
            case Rate.BEAT:
                return 1.0
            case Rate.DEMAND:
                return 0.0


def load_rig(path: str | Path) -> RigConfig:
    """Read and check rig.toml.

    Raises ConfigError naming the file, the field, what is allowed and the nearest valid name.
    """
    path = Path(path)
    data = _read_toml(path)
    if "folder" in data:
        raise ConfigError(f"{path}: unknown key `folder`")
    config: RigConfig = msgspec.structs.replace(_convert(data, path), folder=str(path.parent))
    _check(config, path)
    return config


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ConfigError(
            f"{path}: no such file; config/sim.toml and config/rig.example.toml are ready to copy"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: not valid TOML: {error}") from None


def _convert(data: dict[str, Any], path: Path) -> RigConfig:
    try:
        return msgspec.convert(data, RigConfig)
    except msgspec.ValidationError as error:
        raise ConfigError(f"{path}: {explain(str(error), RigConfig)}") from None


def _check(config: RigConfig, path: Path) -> None:
    """Rules that one field alone cannot say."""
    _unique([c.name for c in config.camera], "[[camera]] name", path)
    _unique([o.name for o in config.object], "[[object]] name", path)
    _unique([o.serial for o in config.object], "[[object]] serial", path)
    for hand, table in config.hand.items():
        where = f"{path}: [hand.{hand}.markers]"
        for landmark in table.markers:
            if landmark not in LANDMARKS:
                near = difflib.get_close_matches(landmark, LANDMARKS, n=1)
                hint = f"did you mean {near[0]!r}? " if near else ""
                raise ConfigError(
                    f"{where}: unknown landmark {landmark!r}; {hint}Valid: {', '.join(LANDMARKS)}"
                )
        if not table.markers:
            raise ConfigError(
                f'{where}: is empty; name at least one landmark, e.g. index_tip = "blue"'
            )
        _unique(list(table.markers.values()), f"colour in [hand.{hand}.markers]", path)
    _unique(
        [c for h in HANDS if h in config.hand for c in config.hand[h].markers.values()],
        "colour of both hands together",
        path,
    )


def _unique(names: list[str], what: str, path: Path) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigError(f"{path}: {what} {twice[0]!r} is used twice; each must be its own")
