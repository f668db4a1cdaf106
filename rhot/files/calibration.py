"""Files that tools write: calibration/*.json, each with its date, tool, inputs and residuals.

Written atomically (a crash leaves the old file). Unknown fields are kept out of the way, not
rejected: a newer tool may say more. A missing or broken file raises CalibrationError with the
command that makes it.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import msgspec
import numpy as np

from rhot.errors import UNDECODABLE, CalibrationError, writing
from rhot.files.config import RigConfig
from rhot.geometry.camera import FISHEYE_NUMBERS, Camera
from rhot.hand import HandModel, HandName, default_hand
from rhot.messages.camera import Calibration, ColorRange, Colors, Exposure

__all__ = [
    "Calibration",
    "CameraPlace",
    "ColorRange",
    "Colors",
    "Exposure",
    "Lens",
    "LensKind",
    "ObjectPlace",
    "Objects",
    "RigGeometry",
    "lens_kind",
    "load",
    "load_cameras",
    "load_colors",
    "load_exposure",
    "load_geometry",
    "load_hand",
    "load_lens",
    "load_objects",
    "load_rig_cameras",
    "save",
]

S = TypeVar("S", bound=msgspec.Struct)
# The lens models: a pinhole with Brown-Conrady distortion, and Kannala & Brandt's of wide lenses.
LensKind = Literal["brown-conrady", "fisheye"]
Row3 = tuple[float, float, float]
Row4 = tuple[float, float, float, float]
Matrix4 = tuple[Row4, Row4, Row4, Row4]
Size = Annotated[int, msgspec.Meta(ge=1, le=65536)]


class Lens(Calibration, frozen=True, kw_only=True):
    """<camera>.lens.json

    distortion is k1, k2, p1, p2, k3 of the model brown-conrady, or k1, k2, k3, k4 of fisheye.
    """

    size_px: tuple[Size, Size]
    matrix: tuple[Row3, Row3, Row3]
    distortion: Annotated[tuple[float, ...], msgspec.Meta(min_length=4, max_length=5)]
    model: LensKind = "brown-conrady"

    def __post_init__(self) -> None:
        wanted = FISHEYE_NUMBERS if self.model == "fisheye" else 5
        if len(self.distortion) != wanted:
            raise ValueError(
                f"distortion of the model {self.model} has {wanted} numbers, not "
                f"{len(self.distortion)}"
            )


def lens_kind(distortion: Sequence[float] | np.ndarray) -> LensKind:
    """The model that so many numbers of distortion belong to."""
    return "fisheye" if len(distortion) == FISHEYE_NUMBERS else "brown-conrady"


class CameraPlace(msgspec.Struct, frozen=True, kw_only=True):
    """Where one camera stands."""

    T_rig_from_camera: Matrix4


class RigGeometry(Calibration, frozen=True, kw_only=True):
    """rig.json"""

    cameras: dict[str, CameraPlace]


class ObjectPlace(msgspec.Struct, frozen=True, kw_only=True):
    """The object's origin in its tracker's frame, and how late the tracker's stamps are.

    marker_m is the middle of the paint on the tracker, in the tracker's frame; None if unknown.
    """

    offset_m: Row3 = (0.0, 0.0, 0.0)
    orientation_wxyz: Row4 = (1.0, 0.0, 0.0, 0.0)
    time_offset_ns: int = 0
    marker_m: Row3 | None = None


class Objects(Calibration, frozen=True, kw_only=True):
    """objects.json"""

    T_rig_from_lighthouse: Matrix4
    # OpenVrPose.universe of the poses that it was made of: another universe is another frame. Empty
    # where unknown.
    universe: str = ""
    # Standard deviation of T_rig_from_lighthouse, None where unknown: of its turn, of its
    # shift at the middle of the volume, and that middle in the rig frame.
    sigma_rad: float | None = None
    sigma_m: float | None = None
    middle_m: Row3 | None = None
    objects: dict[str, ObjectPlace] = msgspec.field(default_factory=dict)


def load(path: Path, kind: type[S], command: str) -> S:
    """One calibration file; `command` is what makes it, for the error."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=kind)
    except FileNotFoundError:
        raise CalibrationError(f"{path}: no such file; make it with `{command}`") from None
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read: {error}") from None
    except UNDECODABLE as error:
        raise CalibrationError(
            f"{path}: {error}; mend it or make it anew with `{command}`"
        ) from None


def save(path: Path, calibration: msgspec.Struct) -> None:
    """Write one calibration file atomically, readable, with its folder.

    Raises DiskFullError where there is no space for it; the old file stays.
    """
    text = msgspec.json.format(msgspec.json.encode(calibration), indent=1)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        _replace(path, text + b"\n")


def _replace(path: Path, content: bytes) -> None:
    """Write beside the file, and put it in its place once all is on the disk."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        # mkstemp makes files only their owner can read; calibrations are read by services of other
        # users.
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def load_lens(folder: Path, camera: str) -> Lens:
    """<camera>.lens.json"""
    return load(folder / f"{camera}.lens.json", Lens, f"rhot calibrate lens {camera}")


def load_colors(folder: Path, camera: str) -> Colors:
    """<camera>.colors.json"""
    return load(folder / f"{camera}.colors.json", Colors, f"rhot calibrate colors {camera}")


def load_exposure(folder: Path, camera: str) -> Exposure:
    """<camera>.exposure.json"""
    return load(folder / f"{camera}.exposure.json", Exposure, f"rhot calibrate camera {camera}")


def load_geometry(folder: Path) -> RigGeometry:
    """rig.json"""
    return load(folder / "rig.json", RigGeometry, "rhot calibrate stereo")


def load_objects(folder: Path) -> Objects:
    """objects.json"""
    return load(folder / "objects.json", Objects, "rhot calibrate objects")


def load_hand(folder: Path, hand: HandName, scale: float = 1.0) -> HandModel:
    """hand.<hand>.json, or the hand of the tables at that scale where nobody has measured one."""
    path = folder / f"hand.{hand}.json"
    if not path.exists():
        return default_hand(hand, scale)
    model = load(path, HandModel, "rhot calibrate hand")
    if model.hand != hand:
        raise CalibrationError(f"{path}: is of a {model.hand} hand; the file name says {hand}")
    return model


def load_cameras(folder: Path, names: list[str]) -> dict[str, Camera]:
    """Every named camera with lens and place, from <camera>.lens.json and rig.json."""
    geometry = load_geometry(folder)
    cameras = {}
    for name in names:
        place = geometry.cameras.get(name)
        if place is None:
            raise CalibrationError(
                f"{folder / 'rig.json'}: camera {name!r} is missing; "
                f"it has {sorted(geometry.cameras)}. Run `rhot calibrate stereo` with all cameras"
            )
        lens = load_lens(folder, name)
        T = np.array(place.T_rig_from_camera)
        cameras[name] = Camera(
            name,
            lens.size_px,
            np.array(lens.matrix),
            np.array(lens.distortion),
            _rigid(T, folder / "rig.json", name),
        )
    return cameras


def load_rig_cameras(config: RigConfig, names: list[str] | None = None) -> dict[str, Camera]:
    """The cameras of rig.toml (or those of these names) in the rig frame: as load_cameras, with
    [rig.world] applied.
    """
    cameras = load_cameras(
        config.calibration_dir, [c.name for c in config.camera] if names is None else names
    )
    if config.rig.world is None:
        return cameras
    T_rig_from_first = _rigid(
        np.array(config.rig.world.T_rig_from_camera),
        Path("rig.toml, [rig.world]"),
        "the first camera",
    )
    return {
        n: replace(camera, T_rig_from_camera=T_rig_from_first @ camera.T_rig_from_camera)
        for n, camera in cameras.items()
    }


def _rigid(T: np.ndarray, path: Path, name: str) -> np.ndarray:
    R = T[:3, :3]
    # 1e-4: a matrix typed with five digits passes, a scaled or mirrored one does not.
    if (
        not np.all(np.isfinite(T))
        or abs(np.linalg.det(R) - 1.0) > 1e-4
        or np.abs(R @ R.T - np.eye(3)).max() > 1e-4
    ):
        raise CalibrationError(
            f"{path}: T_rig_from_camera of {name!r} is not a rigid transform "
            "(rotation and metres); run `rhot calibrate stereo` again"
        )
    return T
