"""What a rig.toml says of cameras, objects, network and viewer, looked at on this machine.

Only what can be known without opening a camera: files, folders and devices of other hosts are left
to their trackers.
"""

from __future__ import annotations

from importlib.util import find_spec
from ipaddress import ip_address
from pathlib import Path

import numpy as np

from rhot.errors import RhotError
from rhot.files.config import CameraTable, RigConfig
from services.cli.check.problems import Problem, error, note, warning
from services.simulator.scene.catalog import scene_spec

_CAMERA_SOURCES = (
    "picamera2[:N], v4l2:N or v4l2:/dev/..., video:FILE, folder:DIR, capture:DIR, simulator"
)
_OBJECT_SOURCES = "steamvr, libsurvive, replay:FILE, simulator, network"
# Zenoh's transports that bring their own protection, and those that never leave the machine.
_PROTECTED, _LOCAL = ("tls", "quic"), ("unixsock-stream", "unixpipe")


def check_rig(config: RigConfig, path: Path) -> list[Problem]:
    """Problems of everything but calibration/."""
    problems = _cameras(config, path)
    for camera in config.camera:
        problems += _source(config, camera, path)
    return (
        problems
        + _world(config, path)
        + _objects(config, path)
        + _bus(config, path)
        + _simulator(config, path)
        + _viewer(config, path)
    )


def _cameras(config: RigConfig, path: Path) -> list[Problem]:
    count = len(config.camera)
    problems = []
    if config.hand and count < 2:
        text = f"[hand]: a hand needs two cameras for depth, there {'is one' if count else 'is none'}; add a [[camera]] table"
        problems.append(error(path, text))
    elif not count and not config.object:
        problems.append(
            error(path, "there is neither a [[camera]] nor an [[object]]; nothing would be tracked")
        )
    if count and not config.hand:
        problems.append(
            note(
                path,
                "there is no [hand.right.markers]: all colours of colors.json are tracked, and no hand is solved",
            )
        )
    places: dict[tuple[str, str], str] = {}
    for camera in config.camera:
        kind = camera.source.partition(":")[0]
        source = "picamera2:0" if camera.source == "picamera2" else camera.source
        other = places.setdefault((camera.host, source), camera.name)
        if other != camera.name and kind in ("picamera2", "v4l2"):
            host = f" of host {camera.host!r}" if camera.host else ""
            problems.append(
                error(
                    path,
                    f"cameras {other!r} and {camera.name!r} have the same source {camera.source!r}{host}",
                )
            )
    if len({camera.fps for camera in config.camera}) > 1:
        rates = ", ".join(f"{camera.name} {camera.fps:g}" for camera in config.camera)
        problems.append(
            warning(
                path,
                f"cameras have different frame rates ({rates}); depth comes at the slower one's",
            )
        )
    return problems


def _world(config: RigConfig, path: Path) -> list[Problem]:
    if config.rig.world is None:
        return []
    T = np.array(config.rig.world.T_rig_from_camera)
    # 1e-4: a matrix typed with five digits passes, a scaled or mirrored one does not.
    rigid = (
        np.abs(T[:3, :3] @ T[:3, :3].T - np.eye(3)).max() < 1e-4 and np.linalg.det(T[:3, :3]) > 0.0
    )
    if rigid and T[3].tolist() == [0.0, 0.0, 0.0, 1.0]:
        return []
    return [
        error(
            path,
            "[rig.world] T_rig_from_camera: is not a rotation with a translation in metres above the row 0, 0, 0, 1",
        )
    ]


def _source(config: RigConfig, camera: CameraTable, path: Path) -> list[Problem]:
    kind, _, detail = camera.source.partition(":")
    where = f"camera {camera.name!r}: source = {camera.source!r}"
    match kind:
        case "simulator" if not detail:
            return []
        case "picamera2" if not detail or detail.isdecimal():
            if camera.host or find_spec("picamera2") is not None:
                return []
            text = f"{where} needs picamera2, which this machine has not; set `host` to the Pi, or `sudo apt install python3-picamera2` here"
            return [warning(path, text)]
        case "v4l2" if detail:
            device = Path(f"/dev/video{detail}" if detail.isdecimal() else detail)
            return (
                []
                if camera.host or device.exists()
                else [
                    error(
                        path, f"{where}: there is no {device}; `v4l2-ctl --list-devices` lists them"
                    )
                ]
            )
        case "video" | "folder" | "capture" if detail:
            return (
                []
                if camera.host
                else _file(Path(config.folder) / detail, kind, camera.name, where, path)
            )
    return [error(path, f"{where}: is no source; valid: {_CAMERA_SOURCES}")]


def _file(target: Path, kind: str, camera: str, where: str, path: Path) -> list[Problem]:
    if kind == "video" and not target.is_file():
        return [error(path, f"{where}: there is no file {target}")]
    if kind != "video" and not target.is_dir():
        return [error(path, f"{where}: there is no folder {target}")]
    if kind == "capture" and not (target / f"{camera}.mkv").is_file():
        found = sorted(video.stem for video in target.glob("*.mkv"))
        return [error(path, f"{where}: the capture has no {camera}.mkv; it has {found}")]
    return []


def _objects(config: RigConfig, path: Path) -> list[Problem]:
    kind, _, detail = config.objects.source.partition(":")
    where = f"[objects] source = {config.objects.source!r}"
    if not config.object:
        return []
    if kind == "replay" and detail:
        target = Path(config.folder) / detail
        return [] if target.is_file() else [error(path, f"{where}: there is no file {target}")]
    if detail or kind not in ("steamvr", "libsurvive", "simulator", "network"):
        return [error(path, f"{where}: is no source; valid: {_OBJECT_SOURCES}")]
    if kind == "simulator" and not any(camera.source == "simulator" for camera in config.camera):
        return [
            warning(
                path,
                f"{where}, but no camera is simulated, so that `rhot up` starts no simulator; valid: {_OBJECT_SOURCES}",
            )
        ]
    return []


def _bus(config: RigConfig, path: Path) -> list[Problem]:
    problems = []
    for key, endpoints in (("connect", config.bus.connect), ("listen", config.bus.listen)):
        if not endpoints:
            problems.append(error(path, f'[bus] {key}: is empty; e.g. ["tcp/127.0.0.1:7447"]'))
        problems += [
            error(path, f"[bus] {key}: {e!r} is no endpoint; e.g. tcp/127.0.0.1:7447")
            for e in endpoints
            if not _is_endpoint(e)
        ]
    for endpoint in config.bus.listen:
        protocol, _, address = endpoint.partition("/")
        if (
            _is_endpoint(endpoint)
            and protocol not in (*_PROTECTED, *_LOCAL)
            and not _is_loopback(address)
        ):
            text = (
                f"[bus] listen: {endpoint!r} is open to its network without protection: anybody there can read and publish; "
                "use a network of your own, or tls/ with certificates (deploy/)"
            )
            problems.append(warning(path, text))
    remote = sorted({camera.host for camera in config.camera if camera.host})
    if remote and all(_is_loopback(endpoint.partition("/")[2]) for endpoint in config.bus.listen):
        problems.append(
            error(
                path,
                f"[bus] listen: only this machine can reach the router, but there are cameras on {', '.join(remote)}",
            )
        )
    return problems


def _is_endpoint(endpoint: str) -> bool:
    protocol, _, address = endpoint.partition("/")
    if protocol in _LOCAL:
        return bool(address)
    host, _, port = address.partition("#")[0].partition("?")[0].rpartition(":")
    return (
        protocol in ("tcp", "udp", "tls", "quic", "ws")
        and bool(host)
        and port.isdecimal()
        and 0 <= int(port) <= 65535
    )


def _is_loopback(address: str) -> bool:
    host = address.partition("#")[0].partition("?")[0].rpartition(":")[0].strip("[]")
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def _simulator(config: RigConfig, path: Path) -> list[Problem]:
    if not any(camera.source == "simulator" for camera in config.camera):
        return []
    try:
        scene_spec(config.simulator.scene)
    except RhotError as unknown:
        return [error(path, f"[simulator] scene: {unknown}")]
    return []


def _viewer(config: RigConfig, path: Path) -> list[Problem]:
    problems = []
    ports = {endpoint.rpartition(":")[2] for endpoint in config.bus.listen}
    if str(config.viewer.port) in ports:
        problems.append(
            error(
                path,
                f"[viewer] port: {config.viewer.port} is the router's port ([bus] listen); give it another, e.g. 8080",
            )
        )
    if 0 < config.viewer.port < 1024:
        problems.append(
            warning(
                path,
                f"[viewer] port: {config.viewer.port} needs root; give it one from 1024 on, or 0 for any free one",
            )
        )
    if find_spec("viser") is None:
        problems.append(
            warning(path, "[viewer]: viser is not installed; `pip install rhot[master]`")
        )
    return problems
