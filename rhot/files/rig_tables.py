"""The tables of rig.toml: every key with its type, bounds, default and reason.

A value outside its bounds is an error that names them (rhot/files/config.py reads the file).
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from rhot.messages import Name

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
    # Folder of this host's ca.pem, own.pem and own.key (`rhot pki`), relative to rig.toml: for the
    # endpoints that begin with tls/.
    certificates: str = "pki"
    # Names of certificates that may look on, and of those that may send what SteamVR sees.
    viewers: tuple[Name, ...] = ()
    object_sources: tuple[Name, ...] = ()
    # Routers of other rigs to join, and the names of those rigs: their viewers see this rig's
    # poses, and this rig's viewers theirs.
    routers: tuple[str, ...] = ()
    partners: tuple[Name, ...] = ()


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
