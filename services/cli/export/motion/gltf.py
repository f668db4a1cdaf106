"""Binary glTF: the skinned hand of rhot/hand_mesh, animated. For Blender, three.js, any viewer.

The skin's joints become a tree (wrist, metacarpals, phalanges) with a person's bone lengths; the
wrist's node carries the hand's size, so that the flesh grows with it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.geometry.transforms import Array
from rhot.hand_mesh.skinned_hand import (
    PARENTS,
    SKIN_JOINTS,
    Fitted,
    mesh_file,
    skinned_hand,
    webxr_name,
)
from services.cli.export.motion.clip import Clip


def gltf_file(clip: Clip) -> bytes:
    """The file's content."""
    glb, mesh = mesh_file(clip.hand), skinned_hand(clip.hand)
    positions = np.zeros((26, 3))
    positions[1:] = clip.positions_m()[0]
    fitted = mesh.fit(positions, clip.rotations[0])
    frames = fitted.frames(clip.rotations)
    nodes: list[dict[str, Any]] = glb.document["nodes"]
    index = {node["name"]: n for n, node in enumerate(nodes)}
    times = glb.add((clip.times_s - clip.times_s[0])[:, None])
    channels: list[dict[str, Any]] = []
    samplers: list[dict[str, Any]] = []

    def animate(node: int, path: str, values: Array) -> None:
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": times, "output": glb.add(values), "interpolation": "LINEAR"})

    for j, name in enumerate(SKIN_JOINTS):
        node, parent = index[webxr_name(name)], PARENTS[name]
        turned = frames[:, j]
        nodes[node] = {"name": webxr_name(name)}
        if parent is None:
            nodes[node] |= {"scale": [fitted.size] * 3, "translation": clip.wrist_m[0].tolist()}
            animate(node, "translation", clip.wrist_m)
        else:
            p = SKIN_JOINTS.index(parent)
            turned = frames[:, p].transpose(0, 2, 1) @ turned
            nodes[node]["translation"] = _translation(clip, fitted, j, p).tolist()
        local = _steady(Rotation.from_matrix(turned).as_quat())
        nodes[node]["rotation"] = local[0].tolist()
        animate(node, "rotation", local)
    _plant_tree(nodes, index)
    name = f"{clip.hand} hand"
    glb.document["animations"] = [{"name": name, "channels": channels, "samplers": samplers}]
    glb.document["asset"] = {"version": "2.0", "generator": "rhot export"}
    return glb.encoded()


def _translation(clip: Clip, fitted: Fitted, j: int, p: int) -> Array:
    """A joint's place in its parent's skin frame, in units of the wrist's scale."""
    offset: Array = fitted.turns[p].T @ clip.offsets_m[j] / fitted.size
    return offset


def _plant_tree(nodes: list[dict[str, Any]], index: dict[str, int]) -> None:
    """Hang each joint on its parent, and the wrist beside the mesh."""
    for name in SKIN_JOINTS:
        children = [index[webxr_name(child)] for child in SKIN_JOINTS if PARENTS[child] == name]
        if children:
            nodes[index[webxr_name(name)]]["children"] = children
    mesh = next(n for n, node in enumerate(nodes) if "mesh" in node)
    nodes[index["Armature"]] = {"name": "Armature", "children": [mesh, index["wrist"]]}


def _steady(quaternions: Array) -> Array:
    """(n, 4) with signs that never jump, so that players go the short way between two."""
    flips = np.cumprod(np.where(np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0, -1.0, 1.0))
    return np.concatenate([quaternions[:1], quaternions[1:] * flips[:, None]])
