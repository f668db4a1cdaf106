"""BVH (Biovision hierarchy): a hand's skeleton and its motion, for Blender, MotionBuilder, Unity.

Metres, y up; the wrist has six channels, joints three (Z, X, Y as most programs write them), tips
are end sites. The palm, the middle of the hand, is left out: it is no bone.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.geometry.transforms import Array
from rhot.hand import JOINT_INDEX
from rhot.hand_mesh.skinned_hand import PARENTS, SKIN_JOINTS
from services.cli.export.motion.clip import Clip

_ROTATIONS = "Zrotation Xrotation Yrotation"
_ROOT = f"Xposition Yposition Zposition {_ROTATIONS}"


def bvh_lines(clip: Clip) -> Iterator[str]:
    """The file's lines."""
    yield "HIERARCHY"
    yield from _joint(clip, "wrist", 0)
    yield "MOTION"
    yield f"Frames: {len(clip.wrist_m)}"
    yield f"Frame Time: {1.0 / clip.rate_hz:.9f}"
    for row in _channels(clip):
        yield " ".join(f"{value:.6g}" if abs(value) > 1e-9 else "0" for value in row)


def _joint(clip: Clip, name: str, depth: int) -> Iterator[str]:
    """A joint and what hangs on it; its channels stand in the order of these lines."""
    indent = "  " * depth
    x, y, z = clip.offsets_m[SKIN_JOINTS.index(name)]
    offset = f"{indent}  OFFSET {x:.6f} {y:.6f} {z:.6f}"
    if name.endswith("_tip"):
        yield from (f"{indent}End Site", f"{indent}{{", offset, f"{indent}}}")
        return
    root = PARENTS[name] is None
    yield f"{indent}{'ROOT' if root else 'JOINT'} {clip.hand}_{name}"
    yield f"{indent}{{"
    yield offset
    yield f"{indent}  CHANNELS {6 if root else 3} {_ROOT if root else _ROTATIONS}"
    for child in SKIN_JOINTS:
        if PARENTS[child] == name:
            yield from _joint(clip, child, depth + 1)
    yield f"{indent}}}"


def _channels(clip: Clip) -> Array:
    """(n, 3 + 3 joints) metres and degrees."""
    columns = [clip.wrist_m]
    for name in SKIN_JOINTS:
        if name.endswith("_tip"):
            continue
        local = clip.rotations[:, JOINT_INDEX[name]]
        parent = PARENTS[name]
        if parent is not None:
            local = clip.rotations[:, JOINT_INDEX[parent]].transpose(0, 2, 1) @ local
        # Capital letters: about the axes as they have been turned, Z first.
        columns.append(Rotation.from_matrix(local).as_euler("ZXY", degrees=True))
    return np.concatenate(columns, axis=1)
