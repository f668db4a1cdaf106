"""A hand's skin: the WebXR generic hand, moved by the joints of our hands. Pure.

left.glb and right.glb are those of npm's @webxr-input-profiles/assets 1.0.20 (MIT, LICENSE.txt): 25
joints with WebXR's names, which are OpenXR's but the palm. A skin joint's frame is the joint's own,
turned by a constant so that its bone runs as it does in the mesh: our metacarpals have the wrist's
frame, those of the mesh run along the bone. Bones take a person's lengths; how thick they are goes
with the whole hand's size.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import DIGITS, JOINT_INDEX, JOINTS, HandName
from rhot.hand_mesh.glb import Glb

# Joints of the skin, and the joint that each hangs on.
SKIN_JOINTS = JOINTS[1:]
PARENTS: dict[str, str | None] = {
    name: None
    if name == "wrist"
    else "wrist"
    if name.endswith("metacarpal")
    else SKIN_JOINTS[SKIN_JOINTS.index(name) - 1]
    for name in SKIN_JOINTS
}
# Shorter than any bone: a message may say anything.
_NO_BONE_M = 1e-4
_PHALANGES = ("proximal", "intermediate", "distal")


def webxr_name(joint: str) -> str:
    """WebXR's name of an OpenXR joint: index_proximal -> index-finger-phalanx-proximal."""
    digit, _, bone = joint.partition("_")
    if joint == "wrist":
        return joint
    finger = {"thumb": "thumb", "little": "pinky-finger"}.get(digit, f"{digit}-finger")
    return f"{finger}-phalanx-{bone}" if bone in _PHALANGES else f"{finger}-{bone}"


@dataclass(frozen=True)
class SkinnedHand:
    """One hand's mesh. rest: transforms (25, 4, 4) of its joints where the mesh is as it is."""

    hand: HandName
    vertices_m: Array  # (n, 3)
    triangles: npt.NDArray[np.int64]  # (m, 3)
    joints: npt.NDArray[np.int64]  # (n, 4) indices into SKIN_JOINTS
    weights: Array  # (n, 4)
    inverse_bind: Array  # (25, 4, 4)
    rest: Array

    def fit(self, positions_m: Array, rotations: Array) -> Fitted:
        """What is constant of a hand whose joints are so in one pose; (26, 3), (26, 3, 3)."""
        turns = np.tile(np.eye(3), (25, 1, 1))
        ours, meshes = 0.0, 0.0
        for j, name in enumerate(SKIN_JOINTS):
            child = _child(name)
            if child is None:
                continue
            a, b = JOINT_INDEX[name], JOINT_INDEX[child]
            bone = rotations[a].T @ (positions_m[b] - positions_m[a])
            own = self.rest[j, :3, :3].T @ (self.rest[b - 1, :3, 3] - self.rest[j, :3, 3])
            if float(np.linalg.norm(bone)) > _NO_BONE_M:
                turns[j] = _turn(own, bone)
            ours, meshes = ours + float(np.linalg.norm(bone)), meshes + float(np.linalg.norm(own))
        for finger in DIGITS:
            tip = SKIN_JOINTS.index(f"{finger}_tip")
            turns[tip] = turns[tip - 1]
        return Fitted(ours / meshes, turns)


@dataclass(frozen=True)
class Fitted:
    """How big a hand is against the mesh, and the turns (25, 3, 3) from its joints' frames."""

    size: float
    turns: Array

    def frames(self, rotations: Array) -> Array:
        """Rotations (..., 25, 3, 3) of the skin's joints for those (..., 26, 3, 3) of the hand."""
        return rotations[..., 1:, :, :] @ self.turns


@cache
def skinned_hand(hand: HandName) -> SkinnedHand:
    """The mesh of one hand, read once."""
    glb = mesh_file(hand)
    document = glb.document
    (skin,) = document["skins"]
    nodes = document["nodes"]
    by_name = {nodes[node]["name"]: n for n, node in enumerate(skin["joints"])}
    order = [by_name[webxr_name(name)] for name in SKIN_JOINTS]
    places = np.empty(25, dtype=np.int64)
    places[order] = np.arange(25)
    (primitive,) = document["meshes"][0]["primitives"]
    attributes = primitive["attributes"]
    rest = np.tile(np.eye(4), (25, 1, 1))
    for row, n in enumerate(order):
        node = nodes[skin["joints"][n]]
        x, y, z, w = node["rotation"]
        rest[row, :3, :3] = rotation_from_quaternion((w, x, y, z))
        rest[row, :3, 3] = node["translation"]
    # glTF's matrices are column by column.
    inverse = glb.array(skin["inverseBindMatrices"]).reshape(25, 4, 4).transpose(0, 2, 1)
    return SkinnedHand(
        hand=hand,
        vertices_m=glb.array(attributes["POSITION"]).astype(np.float64),
        triangles=glb.array(primitive["indices"]).reshape(-1, 3).astype(np.int64),
        joints=places[glb.array(attributes["JOINTS_0"]).astype(np.int64)],
        weights=glb.array(attributes["WEIGHTS_0"]).astype(np.float64),
        inverse_bind=inverse[order].astype(np.float64),
        rest=rest,
    )


def mesh_file(hand: HandName) -> Glb:
    """The file as it is vendored, to be changed by who asks."""
    return Glb.parse((Path(__file__).parent / f"{hand}.glb").read_bytes())


def _child(name: str) -> str | None:
    """The joint at the end of a joint's bone; none of the wrist and of tips."""
    if name == "wrist" or name.endswith("_tip"):
        return None
    return SKIN_JOINTS[SKIN_JOINTS.index(name) + 1]


def _turn(a: Array, b: Array) -> Array:
    """The smallest rotation T with T a parallel to b: a turn about a x b (Rodrigues)."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    v, c = np.cross(a, b), float(a @ b)
    K = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + K + K @ K / max(1.0 + c, 1e-12)
