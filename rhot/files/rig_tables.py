"""The tables of rig.toml: every key with its type, bounds, default and reason.

A value outside its bounds is an error that names them (rhot/files/config.py reads the file).
"""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Literal

import msgspec

from rhot.messages import Name

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Pixels = Annotated[int, msgspec.Meta(ge=16, le=8192)]


class Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of every TOML table."""


class Rig(Table, frozen=True, kw_only=True):
    # First part of every key on the bus: two rigs on one network have two names.
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
    # "certificates": beyond this machine each host may do what the role in its certificate says,
    # and who has none nothing; "open": everybody who reaches the router may do anything.
    access: Literal["certificates", "open"] = "certificates"
    # Names of certificates that may look on.
    viewers: tuple[Name, ...] = ()
    # Names of certificates that may send what SteamVR sees.
    object_sources: tuple[Name, ...] = ()
    # Routers of other rigs to join.
    routers: tuple[str, ...] = ()
    # The names of those rigs: their viewers see this rig's poses, and this rig's viewers theirs.
    partners: tuple[Name, ...] = ()


class CameraTable(Table, frozen=True, kw_only=True):
    # In keys and in the names of its calibration files. The first camera's frame is the rig's: x
    # right, y down, z forward.
    name: Name
    # picamera2[:N], v4l2:N or v4l2:/dev/..., video:FILE, folder:DIR, capture:DIR, simulator.
    source: str = "picamera2"
    # Pictures a second, the same for all cameras: depth comes at the slowest one's.
    fps: Annotated[float, msgspec.Meta(gt=0.0, le=240.0)] = 30.0
    # Width and height. A lens calibration holds for the size that it was made at.
    size_px: tuple[Pixels, Pixels] = (640, 480)
    # Rolling shutter: from the exposure of a picture's top row to that of its bottom row, where the
    # source does not tell it (videos, folders of pictures, v4l2). Phones have 8 to 35. 0: all rows
    # at once.
    readout_ms: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)] = 0.0
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
    # Rounds that take single pixels away.
    erode: Annotated[int, msgspec.Meta(ge=0, le=10)] = 1
    # Rounds that give the rest its size back.
    dilate: Annotated[int, msgspec.Meta(ge=0, le=10)] = 1
    # Pixels of the picture: smaller blobs are noise.
    min_area_px: NonNegative = 12.0
    # Larger blobs are no marker.
    max_area_px: Positive = 20_000.0


class OneEuro(Table, frozen=True, kw_only=True):
    """Casiez, Roussel, Vogel, "1 Euro Filter", CHI 2012."""

    # Of all pairs that halve the jitter of a resting hand (1 mm at 30 Hz), these follow a hand at
    # 0.15-0.5 m/s best: benchmarks/filters.py.
    mincutoff_hz: Positive = 1.2
    # Hz per m/s.
    beta: NonNegative = 170.0
    # Of the speed that the cutoff follows; 1 Hz is what the paper gives.
    dcutoff_hz: Positive = 1.0


class Disparity(Table, frozen=True, kw_only=True):
    """RHOT eq. (9), D = k * x^z with D in cm and x in px, and the alignment angle of eq. (10)."""

    # `rhot calibrate depth` measures k and z; these are the RHOT paper's.
    k: Positive = 4543.3
    # -1 is geometry's; distortion of the lenses moves it a little.
    z: Annotated[float, msgspec.Meta(ge=-3.0, le=-0.1)] = -1.035
    # By how much the cameras' axes are off parallel.
    phi_rad: Annotated[float, msgspec.Meta(ge=-0.5, le=0.5)] = 0.0
    # "power": eq. (9) with k and z above; "geometry": z = -1 and k from eq. (10) with baseline,
    # field of view and phi_rad.
    law: Literal["power", "geometry"] = "power"


class Fusion(Table, frozen=True, kw_only=True):
    # "kalman": every observation at its own instant, all landmarks of a hand in one filter;
    # "triangulate" and "disparity": pair the views first.
    method: Literal["kalman", "triangulate", "disparity"] = "kalman"
    # How paired methods bring views to one instant.
    pairing: Literal["hermite", "linear", "nearest"] = "hermite"
    # Of paired methods: what smooths their points.
    filter: Literal["one_euro", "none"] = "one_euro"
    # Instants a result waits for later observations, in frames of the fastest camera.
    lag_frames: Annotated[int, msgspec.Meta(ge=0, le=2)] = 0
    # A landmark that no camera sees is carried on this long, then dropped; paired methods need two
    # cameras, and "kalman" carries it on for 4.5 frames at least of the slowest camera, as its
    # frames come. What one camera sees is told as long as it does: known across its ray.
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
    # "dls": damped least squares; "fabrik": FABRIK; "analytic": closed form; "dls-paper" and
    # "fabrik-paper": as the papers print them, for comparison.
    method: Literal["dls", "fabrik", "analytic", "dls-paper", "fabrik-paper"] = "dls"
    # Of one finger: a bound for the worst case.
    max_iterations: Annotated[int, msgspec.Meta(ge=1, le=1000)] = 60
    # How close to its marker a finger's tip must come, in metres.
    tolerance_m: Positive = 1e-4


class ObjectTable(Table, frozen=True, kw_only=True):
    # In its key on the bus.
    name: Name
    # Of its tracker, as SteamVR shows it: LHR-...
    serial: Name
    # Colour of a dab of paint on its tracker, for registration and for the watch on drift. No
    # hand's marker may have it.
    marker: Name | None = None
    # What it looks like, for touch, view and simulation; empty: unknown, and nothing touches it.
    shape: Literal["", "box", "cylinder", "sphere", "mesh"] = ""
    # Box: along x, y and z. Cylinder: diameter, and height along y. Sphere: diameter. The object's
    # origin is the middle.
    size_m: Annotated[
        tuple[Annotated[float, msgspec.Meta(gt=0.0, le=10.0)], ...], msgspec.Meta(max_length=3)
    ] = ()
    # GLB or STL file of a mesh, relative to rig.toml, in metres and in the object's own frame.
    mesh: str = ""


class Objects(Table, frozen=True, kw_only=True):
    # steamvr (rhot-openvr-bridge sends what SteamVR tracks), libsurvive, replay:FILE (any recording
    # of poses), playback:FILE.rec.gz (by libsurvive), simulator, or network (poses arrive on the
    # bus from elsewhere).
    source: str = "simulator"
    # Of steamvr: host that SteamVR and rhot-openvr-bridge run on; empty: the machine of `rhot up`.
    host: str = ""
    # Poses a second of each tracker; SteamVR has a new one some 250 times a second. Four for each
    # picture of a 30 Hz camera.
    rate_hz: Annotated[float, msgspec.Meta(gt=0.0, le=1000.0)] = 120.0
    # Further arguments of libsurvive's survive-cli: ["--lighthouse-gen", "2"].
    arguments: list[str] = []
    # Of a replay: 2 plays it in half its time, and poses are stamped as of now.
    speed: Annotated[float, msgspec.Meta(gt=0.0, le=100.0)] = 1.0
    # Of a replay: begin anew at its end; poses are stamped as of now.
    loop: bool = False
    # Smoothing, as the millimetres by which it may let a moving object lag; 0: none. 0.5 leaves a
    # third of the jitter of a tracker that rests, 0.2 a half, and more than 0.5 gains nothing:
    # benchmarks/objects_tracking.py.
    filter_mm: Annotated[float, msgspec.Meta(ge=0.0, le=20.0)] = 0.5
    # Once the paint on a tracker and its pose drift apart: report it, or correct poses as well, by
    # up to 30 mm; calibration files are never changed.
    drift: Literal["report", "correct"] = "report"


class HandTable(Table, frozen=True, kw_only=True):
    # Landmark = colour: wrist, thumb_tip, index_tip, middle_tip, ring_tip, little_tip, and as an
    # extra any other OpenXR joint; middle_proximal, the middle knuckle, helps most. Landmarks may
    # share a colour: their dots are told apart by how they hang together and move. Show all of
    # them at the start, fingers apart, or give their places (`rhot track --seed`).
    markers: dict[str, Name] = {}
    # The one colour of dots on all four joints of each of `fingers`, e.g. "red". A landmark in
    # `markers` has the colour that it has there.
    joints: Name | None = None
    # Empty: those whose dots there are: of 4 dots the index finger, of 8 thumb and index finger, of
    # 12 the middle finger too, of 16 all but the thumb, of 20 all.
    fingers: tuple[Literal["thumb", "index", "middle", "ring", "little"], ...] = ()
    # Size against the average adult, about: points show the rest until `rhot calibrate hand` has
    # measured it.
    scale: Annotated[float, msgspec.Meta(ge=0.4, le=1.6)] = 1.0

    @property
    def marker_names(self) -> dict[str, str]:
        """What each landmark's marker is called: its colour; if shared, e.g. red.index_tip."""
        wearers = Counter(self.markers.values())
        return {
            landmark: color if wearers[color] == 1 else f"{color}.{landmark}"
            for landmark, color in self.markers.items()
        }


class Viewer(Table, frozen=True, kw_only=True):
    # For browsers of this machine; "0.0.0.0" lets in others, who need the token.
    host: str = "127.0.0.1"
    # 16 or more letters, digits, "-", "_"; the page is then at http://HOST:8080/?token=TOKEN.
    token: Annotated[str, msgspec.Meta(pattern=r"^([A-Za-z0-9_-]{16,128})?$")] = ""
    # Of the live view; the next free one if it is taken, 0 for any. Of several rigs of a master
    # that do not choose, the first has this one, and each other the next.
    port: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 8080
    # How often the view is drawn, in Hz.
    rate_hz: Annotated[float, msgspec.Meta(gt=0.0, le=60.0)] = 30.0


class Recorder(Table, frozen=True, kw_only=True):
    # Of recordings, relative to rig.toml.
    folder: str = "recordings"
    # Record from the start of `rhot up` on.
    autostart: bool = False
    # A longer recording goes on in a new file, without a gap: a file's index is held in memory.
    part_minutes: Annotated[float, msgspec.Meta(gt=0.0, le=1440.0)] = 60.0
    # The same for its size.
    part_mb: Annotated[float, msgspec.Meta(ge=1.0, le=1e6)] = 2000.0
    # Also what Foxglove and Rerun draw: 5.5 instead of 2.7 MB/min (a hand, a cup, two cameras).
    foxglove: bool = True


class Metrics(Table, frozen=True, kw_only=True):
    # Health for Prometheus, at http://HOST:PORT/metrics, from `rhot up` and from systemd.
    enabled: bool = False
    # Who may ask: by default this machine only. There is no password.
    host: str = "127.0.0.1"
    # 0 for any free one.
    port: Annotated[int, msgspec.Meta(ge=0, le=65535)] = 9464


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
