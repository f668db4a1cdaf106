"""What objects look like on the page: shape, mesh (a GLB or STL file), place of the tracker.

A file is bounded in size and in triangles: a browser on a small computer has to draw it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from rhot.errors import ConfigError
from rhot.files.calibration import ObjectPlace
from rhot.files.rig_tables import ObjectTable
from rhot.geometry.transforms import Array
from services.viewer.scene.shapes import Faces

# A scan of a cup has some 2 MB; what is larger takes seconds to reach a browser.
_MAX_BYTES = 20_000_000
# Beyond this Chromium without a graphics card draws fewer than 10 pictures a second.
_MAX_FACES = 200_000
# An object that is larger than any room is one in millimetres.
_MAX_M = 10.0
_KINDS = (".glb", ".stl")


@dataclass(frozen=True, eq=False)
class ObjectLook:
    """What an object looks like: its table of rig.toml, its mesh, where its tracker sits."""

    table: ObjectTable | None = None
    mesh: tuple[Array, Faces] | None = None
    place: ObjectPlace | None = None


def read_mesh(path: Path) -> tuple[Array, Faces]:
    """Vertices (n, 3) in metres and faces (m, 3) of a GLB or STL file.

    Raises ConfigError with the reason if it cannot be drawn.
    """
    kind = path.suffix.lower()
    if kind not in _KINDS:
        raise ConfigError(f"{path.name}: is no {' or '.join(_KINDS)} file")
    try:
        size = path.stat().st_size
        if size > _MAX_BYTES:
            raise ConfigError(
                f"{path.name}: has {size / 1e6:.0f} MB, at most {_MAX_BYTES / 1e6:.0f} are drawn"
            )
        with path.open("rb") as file:
            mesh = trimesh.load_mesh(file, file_type=kind[1:])
    except OSError as error:
        raise ConfigError(f"{path.name}: {error.strerror or error}") from None
    except ConfigError:
        raise
    # Whatever a broken file makes of a parser that was written for whole ones.
    except Exception as error:
        raise ConfigError(f"{path.name}: cannot be read as {kind[1:]}: {error}") from None
    return _checked(path, mesh)


def _checked(path: Path, mesh: object) -> tuple[Array, Faces]:
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise ConfigError(f"{path.name}: holds no triangles")
    if len(mesh.faces) > _MAX_FACES:
        raise ConfigError(
            f"{path.name}: has {len(mesh.faces)} triangles, at most {_MAX_FACES} are drawn"
        )
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    if not np.all(np.abs(vertices) <= _MAX_M):
        raise ConfigError(
            f"{path.name}: reaches beyond {_MAX_M:g} m; metres are expected, is it in mm?"
        )
    return vertices, np.asarray(mesh.faces, dtype=np.uint32)
