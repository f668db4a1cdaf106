"""The files of the WebXR page, by the paths that they are served at. Pure.

three.min.js is npm's three (MIT), bundled as page/vendor/three.entry.js says; the hands' meshes are
those of rhot/hand_mesh. Nothing else is loaded, from nowhere else.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

import rhot.hand_mesh
from rhot.geometry.transforms import rotation_from_quaternion, transform
from rhot.hand import HANDS
from services.bridges.placement import Placement
from services.bridges.websocket.server import File

PAGE = "/xr"
LIVE = "/live"
_FOLDER = Path(__file__).parent / "page"
_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".txt": "text/plain; charset=utf-8",
    ".glb": "model/gltf-binary",
}


def files(meshes: Mapping[str, bytes]) -> dict[str, File]:
    """All of the page; meshes are GLB files by the objects' names, and need the token."""
    found = {PAGE: _file(_FOLDER / "index.html")}
    for path in sorted(_FOLDER.rglob("*")):
        if path.is_file() and path.name != "index.html":
            found[f"{PAGE}/{path.relative_to(_FOLDER).as_posix()}"] = _file(path)
    for hand in HANDS:
        path = Path(rhot.hand_mesh.__file__).parent / f"{hand}.glb"
        found[f"{PAGE}/{path.name}"] = _file(path)
    for name, content in meshes.items():
        found[mesh_path(name)] = File(content, _TYPES[".glb"], open=False)
    return found


def mesh_path(name: str) -> str:
    """Where an object's mesh is served."""
    return f"{PAGE}/objects/{name}.glb"


def floor_from_rig(placement: Placement) -> list[float]:
    """T_floor_from_rig (4, 4) row by row, for WebXR's local-floor: x right, y up, z backward."""
    T = transform(rotation_from_quaternion(placement.turn_wxyz), np.array(placement.origin_m))
    return [round(float(value), 9) for value in T.ravel()]


def _file(path: Path) -> File:
    return File(path.read_bytes(), _TYPES[path.suffix])
