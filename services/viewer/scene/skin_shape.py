"""Where a hand's skin is, for the joints of a pose: linear blend skinning as one product. Pure.

A vertex is sum_j w_j (F_j l_j + p_j): F_j and p_j are the frame and the place of skin joint j, l_j
the vertex in that joint's frame. What is constant of a person, w_j and l_j, is one matrix; what a
pose changes, F_j and p_j, is another; their product is the skin. Joints are those of the message
itself, so that skin and bones cannot be apart.

Bones have the person's lengths: what lies along a bone is stretched to it, what lies across it goes
with the size of the whole hand. Our tips are where the finger ends, those of the mesh some 10 mm
before: its last bones are taken as long as their skin.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from rhot.hand import DIGITS, HandName
from rhot.hand_mesh.skinned_hand import SKIN_JOINTS, SkinnedHand, skinned_hand
from rhot.hand_skin import PARTS

Vertices = npt.NDArray[np.float32]
Faces = npt.NDArray[np.uint32]
Indices = npt.NDArray[np.int64]

# A person's bones keep their lengths; beyond this it is another person's hand, or another
# calibration. A solver's own bones differ by less than 1 nm from pose to pose.
_OTHER_BONES_M = 5e-4
# The lit skin lies so far over the skin that a browser's depth buffer keeps them apart.
_OVER_SKIN_M = 0.0008
# Bones of the skin's joints: (start, end) rows of SKIN_JOINTS. Wrist and tips begin none.
_BONES = np.array(
    [
        (j, j + 1)
        for j, name in enumerate(SKIN_JOINTS)
        if name != "wrist" and not name.endswith("_tip")
    ]
)
# A tip turns with the last bone: its skin is that bone's.
_TIPS = np.array([j for j, name in enumerate(SKIN_JOINTS) if name.endswith("_tip")])
_WITHOUT_TIPS = np.arange(25)
_WITHOUT_TIPS[_TIPS] -= 1


@dataclass(frozen=True, eq=False)
class LitSkin:
    """The skin of some parts of a hand, a little over it."""

    blend: Vertices  # (n, 100)
    faces: Faces


@dataclass(frozen=True, eq=False)
class SkinShape:
    """A person's skin. blend (n, 100): each vertex in the frame of each of 25 joints, weighted.

    bones_m (20, 3) are the bones in their joints' frames, turns (25, 3, 3) the skin's frames
    against the joints'.
    """

    bones_m: Array
    turns: Array
    blend: Vertices
    over: Vertices  # (n, 100), the same for a skin just above it
    faces: Faces
    parts: npt.NDArray[np.int64]  # (n,) rows of PARTS, -1 for none of them

    def fits(self, positions_m: Array, rotations: Array) -> bool:
        """Whether these joints, (26, 3) and (26, 3, 3), are of the same hand."""
        bones_m = _bones(positions_m, rotations)
        return bool(np.all(np.abs(bones_m - self.bones_m) < _OTHER_BONES_M))

    def vertices(self, positions_m: Array, rotations: Array) -> Vertices:
        """(n, 3) in the frame of the joints (26, 3) and (26, 3, 3)."""
        return self.blend @ self._frames(positions_m, rotations)

    def lit(self, parts: Iterable[str]) -> LitSkin:
        """The skin of parts of the hand (rhot.hand_skin.PARTS) and of no other."""
        wanted = np.isin(self.parts, [PARTS.index(part) for part in parts])
        faces = self.faces[np.all(wanted[self.faces], axis=1)]
        used, where = np.unique(faces, return_inverse=True)
        return LitSkin(self.over[used], where.reshape(-1, 3).astype(np.uint32))

    def lit_vertices(self, lit: LitSkin, positions_m: Array, rotations: Array) -> Vertices:
        """The vertices (m, 3) of a lit skin, as `vertices`."""
        return lit.blend @ self._frames(positions_m, rotations)

    def _frames(self, positions_m: Array, rotations: Array) -> Vertices:
        """(100, 3): of each joint the three axes of its frame, and its place."""
        frames = np.empty((25, 4, 3), dtype=np.float32)
        frames[:, :3] = np.swapaxes(rotations[1:] @ self.turns, 1, 2)
        frames[:, 3] = positions_m[1:]
        return frames.reshape(100, 3)


def fit_skin(hand: HandName, positions_m: Array, rotations: Array) -> SkinShape:
    """The skin of a hand that has these joints, (26, 3) and (26, 3, 3), in any pose."""
    mesh = skinned_hand(hand)
    bones_m = _bones(positions_m, rotations)
    vertices, faces, kept = _welded(mesh)
    joints, weights = _WITHOUT_TIPS[mesh.joints[kept]], mesh.weights[kept]
    owner = joints[np.arange(len(joints)), np.argmax(weights, axis=1)]
    local = _stretched(mesh, bones_m, _in_joints(mesh, vertices, joints), joints, owner)
    normals = np.einsum(
        "nkij,nj->nki", mesh.inverse_bind[joints, :3, :3], _normals(vertices, faces)
    )
    back = normals[np.arange(len(joints)), np.argmax(weights, axis=1), 1] > 0.0
    parts = _PART_OF_JOINT[owner]
    # The palm is the palm's side of the hand: its back touches nothing.
    parts[back & (parts == PARTS.index("palm"))] = -1
    return SkinShape(
        bones_m=bones_m,
        turns=mesh.fit(positions_m, rotations).turns,
        blend=_blend(joints, weights, local),
        over=_blend(joints, weights, local + _OVER_SKIN_M * normals),
        faces=faces,
        parts=parts,
    )


def _bones(positions_m: Array, rotations: Array) -> Array:
    """(20, 3) bones in the frames of the joints that they start at."""
    start, end = _BONES.T + 1
    bones_m: Array = np.einsum(
        "bji,bj->bi", rotations[start], positions_m[end] - positions_m[start]
    )
    return bones_m


def _in_joints(mesh: SkinnedHand, vertices: Array, joints: Indices) -> Array:
    """Vertices (n, 3) in the frames (n, 4) of their joints: (n, 4, 3), as large as the mesh."""
    inverse = mesh.inverse_bind[joints]
    local: Array = np.einsum("nkij,nj->nki", inverse[..., :3, :3], vertices) + inverse[..., :3, 3]
    return local


def _stretched(
    mesh: SkinnedHand, bones_m: Array, local: Array, joints: Indices, owner: Indices
) -> Array:
    """Vertices (n, 4, 3) in the frames of their joints, as large as the person's hand."""
    (start, end), rest = _BONES.T, mesh.rest
    own = np.einsum("bji,bj->bi", rest[start, :3, :3], rest[end, :3, 3] - rest[start, :3, 3])
    length = np.linalg.norm(own, axis=1)
    axis = np.zeros((25, 3))
    axis[start] = own / length[:, None]
    along = np.einsum("nki,nki->nk", local, axis[joints])
    to_tip = np.isin(end, _TIPS)
    for bone in np.flatnonzero(to_tip):
        length[bone] = along[(joints == start[bone]) & (owner == start[bone])[:, None]].max()
    ours = np.linalg.norm(bones_m, axis=1)
    size = ours[~to_tip].sum() / length[~to_tip].sum()
    ratio = np.full(25, size)
    ratio[start] = ours / length
    # What lies before a joint belongs to no bone of its own.
    more = np.where(along > 0.0, ratio[joints] - size, 0.0) * along
    stretched: Array = size * local + more[..., None] * axis[joints]
    return stretched


def _blend(joints: Indices, weights: Array, local: Array) -> Vertices:
    """(n, 100): weights times places in the joints' frames, and the weights themselves."""
    blend = np.zeros((len(joints), 25, 4))
    rows = np.arange(len(joints))[:, None]
    np.add.at(blend, (rows, joints), weights[..., None] * np.insert(local, 3, 1.0, axis=-1))
    return blend.reshape(-1, 100).astype(np.float32)


def _welded(mesh: SkinnedHand) -> tuple[Array, Faces, npt.NDArray[np.intp]]:
    """Vertices, faces, and which of the mesh's vertices they are.

    The file has vertices twice where its texture has a seam: lit from outside, one would see it.
    """
    _, kept, where = np.unique(
        mesh.vertices_m.round(6), axis=0, return_index=True, return_inverse=True
    )
    faces = where.reshape(-1)[mesh.triangles]
    a, b, c = faces.T
    whole = (a != b) & (b != c) & (c != a)
    return mesh.vertices_m[kept], faces[whole].astype(np.uint32), kept


def _normals(vertices: Array, faces: Faces) -> Array:
    """Unit normals (n, 3) of vertices, those of their faces by area."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    of_face = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(normals, faces[:, i], of_face)
    length = np.linalg.norm(normals, axis=1)
    return normals / np.maximum(length, 1e-12)[:, None]


def _part_of(joint: str) -> int:
    """A finger touches with its last bone, the palm with what is no finger."""
    digit, _, bone = joint.partition("_")
    if bone in ("distal", "tip"):
        return PARTS.index(digit)
    palm = bone == "metacarpal" and digit in DIGITS[1:]
    return PARTS.index("palm") if palm else -1


_PART_OF_JOINT = np.array([_part_of(joint) for joint in SKIN_JOINTS])
