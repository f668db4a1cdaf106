"""Problems of a rig.toml's cameras, frame and scene, and of what sources.py and network.py check.

Only what can be known without opening a camera: files, folders and devices of other hosts are left
to their trackers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rhot.errors import RhotError
from rhot.files.config import RigConfig
from services.cli.check.network import check_bus, check_viewer
from services.cli.check.problems import Problem, error, note, warning
from services.cli.check.sources import check_camera_source, check_object_source
from services.cli.check.steamvr import check_steamvr
from services.cli.rig.place import Place
from services.simulator.scene.catalog import scene_spec

# Sources that one camera has for itself.
_DEVICES = ("picamera2", "v4l2")


def check_rig(config: RigConfig, path: Path, place: Place, steamvr: Path) -> list[Problem]:
    """Problems of everything but calibration/; of devices and files only those of this machine.

    steamvr is the file in which SteamVR would note where it is here.
    """
    problems = _cameras(config, path) + _same_device(config, path)
    for camera in config.camera:
        here = camera.name in place.cameras
        problems += check_camera_source(config, camera, path, here=here)
    problems += check_steamvr(config, path, place, steamvr)
    problems += _world(config, path) + check_bus(config, path) + _simulator(config, path)
    if place.master:
        problems += check_object_source(config, path) + check_viewer(config, path)
    return problems


def _cameras(config: RigConfig, path: Path) -> list[Problem]:
    count = len(config.camera)
    problems = []
    if config.hand and not count:
        text = "[hand]: a hand needs two cameras for depth, there is none; add a [[camera]] table"
        problems.append(error(path, text))
    elif config.hand and count == 1:
        text = (
            "there is one camera: its markers are tracked, but a hand needs two for depth, and is "
            "not solved"
        )
        problems.append(note(path, text))
    elif not count and not config.object:
        text = "there is neither a [[camera]] nor an [[object]]; nothing would be tracked"
        problems.append(error(path, text))
    if count and not config.hand:
        text = (
            "there is no [hand.right.markers]: all colours of colors.json are tracked, and no hand "
            "is solved"
        )
        problems.append(note(path, text))
    if len({camera.fps for camera in config.camera}) > 1:
        rates = ", ".join(f"{camera.name} {camera.fps:g}" for camera in config.camera)
        text = f"cameras have different frame rates ({rates}); depth comes at the slower one's"
        problems.append(warning(path, text))
    return problems


def _same_device(config: RigConfig, path: Path) -> list[Problem]:
    """Cameras of one host that name the same device."""
    problems = []
    owners: dict[tuple[str, str], str] = {}
    for camera in config.camera:
        source = "picamera2:0" if camera.source == "picamera2" else camera.source
        owner = owners.setdefault((camera.host, source), camera.name)
        if owner != camera.name and camera.source.partition(":")[0] in _DEVICES:
            host = f" of host {camera.host!r}" if camera.host else ""
            text = (
                f"cameras {owner!r} and {camera.name!r} have the same source "
                f"{camera.source!r}{host}"
            )
            problems.append(error(path, text))
    return problems


def _world(config: RigConfig, path: Path) -> list[Problem]:
    if config.rig.world is None:
        return []
    T = np.array(config.rig.world.T_rig_from_camera)
    R = T[:3, :3]
    # 1e-4: a matrix typed with five digits passes, a scaled or mirrored one does not.
    rotation = np.abs(R @ R.T - np.eye(3)).max() < 1e-4 and np.linalg.det(R) > 0.0
    if rotation and T[3].tolist() == [0.0, 0.0, 0.0, 1.0]:
        return []
    text = (
        "[rig.world] T_rig_from_camera: is not a rotation with a translation in metres above the "
        "row 0, 0, 0, 1"
    )
    return [error(path, text)]


def _simulator(config: RigConfig, path: Path) -> list[Problem]:
    if not any(camera.source == "simulator" for camera in config.camera):
        return []
    try:
        scene_spec(config.simulator.scene)
    except RhotError as unknown:
        return [error(path, f"[simulator] scene: {unknown}")]
    return []
