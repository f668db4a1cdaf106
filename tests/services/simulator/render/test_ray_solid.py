"""Solids look like what they are: silhouettes, faces, and their trackers."""

from __future__ import annotations

import struct
from itertools import product

import cv2
import msgspec
import numpy as np
import pytest

from rhot.files.rig_tables import ObjectTable
from rhot.geometry.transforms import apply
from services.simulator.render.renderer import Renderer
from services.simulator.scene.scene import load_scene

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
SIZE_M = (0.07, 0.11, 0.05)


def rim(radius: float, height: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    return np.stack([radius * np.cos(angle), np.full(200, height), radius * np.sin(angle)], axis=1)


# What rig.toml says, and points whose convex hull is the shape.
SHAPES = {
    "box": (
        ObjectTable(name="it", serial="S1", shape="box", size_m=SIZE_M),
        0.5 * CORNERS * SIZE_M,
    ),
    "cylinder": (
        ObjectTable(name="it", serial="S1", shape="cylinder", size_m=(0.08, 0.1)),
        np.concatenate([rim(0.04, 0.05), rim(0.04, -0.05)]),
    ),
    "mesh": (
        ObjectTable(name="it", serial="S1", shape="mesh", mesh="box.stl"),
        0.5 * CORNERS * SIZE_M,
    ),
}


def write_box(path) -> None:
    """A box of SIZE_M as a binary STL file, wound outwards."""
    faces = []
    for axis, side in product(range(3), (-1.0, 1.0)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        quad = np.zeros((4, 3))
        quad[:, axis] = side
        quad[:, u], quad[:, v] = (-1, 1, 1, -1), (-1, -1, 1, 1)
        quad = (quad if side > 0 else quad[::-1]) * 0.5 * np.array(SIZE_M)
        faces += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    body = b"".join(struct.pack("<12fH", *np.zeros(3), *f.ravel(), 0) for f in faces)
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + body)


@pytest.fixture
def rig(config, tmp_path):
    """The simulated rig with an object of that shape, and a mesh file beside its rig.toml."""
    (tmp_path / "calibration").symlink_to(config.calibration_dir.resolve())
    write_box(tmp_path / "box.stl")

    def of(name: str):
        return msgspec.structs.replace(config, object=[SHAPES[name][0]], folder=str(tmp_path))

    return of


@pytest.mark.parametrize("name", SHAPES)
def test_silhouettes_are_those_of_the_projected_shape(rig, name):
    scene = load_scene(rig(name), "registration", seed=3)
    renderer = Renderer(scene, "left")
    camera = scene.cameras["left"]
    row_s = renderer.clock.row_time_ns * 1e-9
    seen = 0
    for t_s in np.arange(0.0, 12.0, 1.5):
        # Only the body: the tracker hides parts of it.
        body = renderer.shapes.arrays.kind[:, 0] == 1
        mask = renderer.labels(float(t_s), only=body) > 0
        rows, _ = np.nonzero(mask)
        if not len(rows) or mask[[0, -1]].any() or mask[:, [0, -1]].any():
            continue
        own_s = float(t_s) + float(rows.mean()) * row_s
        outline = camera.project(apply(scene.object_poses(own_s)["it"], SHAPES[name][1]))
        # Sixteenths of a pixel, whose middle is where its ray goes.
        hull = np.rint(cv2.convexHull(outline.astype(np.float32)) * 16).astype(np.int32)
        expected = np.zeros(mask.shape, np.uint8)
        cv2.fillConvexPoly(expected, hull, 1, shift=4)
        both = np.count_nonzero(mask & (expected > 0))
        either = np.count_nonzero(mask | (expected > 0))
        # fillConvexPoly draws its border half a pixel too wide: of 40 x 60 px some 5 %.
        assert both / either > 0.93, (t_s, both, either)
        assert np.count_nonzero(mask & ~cv2.dilate(expected, np.ones((3, 3))).astype(bool)) == 0
        seen += 1
    assert seen >= 3


def test_a_mesh_of_a_box_looks_like_the_box(rig):
    pictures = []
    for name in ("box", "mesh"):
        renderer = Renderer(load_scene(rig(name), "registration", seed=3), "left")
        renderer.clean(2.0)
        pictures.append(renderer.light.copy())
    # Some pixels at the outline are hit by the one and missed by the other, which is 1 mm larger.
    assert np.mean(np.abs(pictures[0] - pictures[1]).max(axis=2) > 0.02) < 2e-3


def test_faces_of_a_box_are_evenly_lit_and_differ(rig):
    scene = load_scene(rig("box"), "registration", seed=3)
    renderer = Renderer(scene, "left")
    renderer.clean(2.0)
    body = renderer._buffers.label == 2
    lit = renderer.light[..., 1][cv2.erode(body.astype(np.uint8), np.ones((5, 5))) > 0]
    levels = np.histogram(lit, bins=12)[0] / len(lit)
    # One, two or three faces in view, each with little texture: the light keeps to few levels.
    assert np.sort(levels)[-6:].sum() > 0.9


def test_a_sphere_is_a_ball(rig, config):
    table = ObjectTable(name="it", serial="S1", shape="sphere", size_m=(0.06,))
    scene = load_scene(msgspec.structs.replace(config, object=[table]), "registration", seed=3)
    renderer = Renderer(scene, "left")
    mask = renderer.labels(2.0, only=renderer.shapes.arrays.kind[:, 0] == 1) > 0
    rows, columns = np.nonzero(mask)
    T = scene.object_poses(2.0 + float(rows.mean()) * renderer.clock.row_time_ns * 1e-9)["it"]
    middle = scene.cameras["left"].project(T[:3, 3])[0]
    np.testing.assert_allclose((columns.mean(), rows.mean()), middle, atol=1.0)
    radius_px = scene.cameras["left"].focal_px[0] * 0.03 / T[2, 3]
    assert np.count_nonzero(mask) == pytest.approx(np.pi * radius_px**2, rel=0.08)
