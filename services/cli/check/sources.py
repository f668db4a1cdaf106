"""Problems of the sources of cameras and objects, as far as this machine can tell."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from rhot.errors import RhotError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from services.cli.check.problems import Problem, error, warning
from services.object_tracker.recorded.recording import UNNAMED, kind_of, read_poses
from services.object_tracker.sources.survive_command import survive_command

_CAMERA_SOURCES = (
    "picamera2[:N], v4l2:N or v4l2:/dev/..., video:FILE, folder:DIR, capture:DIR, simulator"
)
_OBJECT_SOURCES = "steamvr, libsurvive, replay:FILE, playback:FILE.rec.gz, simulator, network"


def check_camera_source(
    config: RigConfig, camera: CameraTable, path: Path, *, here: bool
) -> list[Problem]:
    """Whether the source of a camera can be used; devices and files that are not here pass."""
    kind, _, detail = camera.source.partition(":")
    where = f"camera {camera.name!r}: source = {camera.source!r}"
    match kind:
        case "simulator" if not detail:
            return []
        case "picamera2" if not detail or detail.isdecimal():
            if not here or find_spec("picamera2") is not None:
                return []
            text = (
                f"{where} needs picamera2, which this machine has not; set `host` to the Pi, or "
                "`sudo apt install python3-picamera2` here"
            )
            return [warning(path, text)]
        case "v4l2" if detail:
            device = Path(f"/dev/video{detail}" if detail.isdecimal() else detail)
            if not here or device.exists():
                return []
            text = f"{where}: there is no {device}; `v4l2-ctl --list-devices` lists them"
            return [error(path, text)]
        case "video" | "folder" | "capture" if detail:
            if not here:
                return []
            return _check_files(Path(config.folder) / detail, kind, camera.name, where, path)
    return [error(path, f"{where}: is no source; valid: {_CAMERA_SOURCES}")]


def _check_files(target: Path, kind: str, camera: str, where: str, path: Path) -> list[Problem]:
    if kind == "video" and not target.is_file():
        return [error(path, f"{where}: there is no file {target}")]
    if kind != "video" and not target.is_dir():
        return [error(path, f"{where}: there is no folder {target}")]
    if kind == "capture" and not (target / f"{camera}.mkv").is_file():
        found = sorted(video.stem for video in target.glob("*.mkv"))
        return [error(path, f"{where}: the capture has no {camera}.mkv; it has {found}")]
    return []


def check_object_source(config: RigConfig, path: Path) -> list[Problem]:
    """Whether the source of the objects can be used."""
    if not config.object:
        return []
    kind, _, detail = config.objects.source.partition(":")
    where = f"[objects] source = {config.objects.source!r}"
    if kind in ("replay", "playback") and detail:
        return _check_recording(config, kind, Path(config.folder) / detail, where, path)
    if kind == "libsurvive" and not detail:
        return _check_survive(where, path)
    if detail or kind not in ("steamvr", "simulator", "network"):
        return [error(path, f"{where}: is no source; valid: {_OBJECT_SOURCES}")]
    if kind == "simulator" and not any(camera.source == "simulator" for camera in config.camera):
        text = (
            f"{where}, but no camera is simulated, so that `rhot up` starts no simulator; "
            f"valid: {_OBJECT_SOURCES}"
        )
        return [warning(path, text)]
    return []


def _check_recording(
    config: RigConfig, kind: str, target: Path, where: str, path: Path
) -> list[Problem]:
    """Whether a recording of poses is there and of a known kind, and names its devices."""
    if not target.exists():
        return [error(path, f"{where}: there is no file {target}")]
    try:
        found = kind_of(target)
        first = next(iter(read_poses(target))) if kind == "replay" else None
    except RhotError as wrong:
        return [error(path, f"{where}: {wrong}")]
    if kind == "playback":
        if found != "libsurvive":
            return [error(path, f"{where}: this is no recording of libsurvive; use replay:FILE")]
        return _check_survive(where, path)
    if first is not None and first.device.serial == UNNAMED and len(config.object) > 1:
        text = (
            f"{where}: the recording names no device, and there is more than one [[object]]; give"
            f" one of them the serial {UNNAMED!r}"
        )
        return [warning(path, text)]
    return []


def _check_survive(where: str, path: Path) -> list[Problem]:
    """Whether libsurvive can be run on this machine (it need not be the one that has trackers)."""
    try:
        survive_command()
    except RhotError as wrong:
        return [warning(path, f"{where}: {wrong}")]
    return []
