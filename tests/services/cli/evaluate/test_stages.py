"""Markers and points made from the truth have no error; what is added to them is found."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.geometry.camera import Camera, pinhole
from rhot.geometry.transforms import rotation_from_quaternion
from rhot.hand import BASIC_LANDMARKS, forward, landmark_point
from rhot.messages import HandPoint, HandPoints, Marker, MarkerFrame
from services.cli.evaluate.stages import landmark_truth, marker_errors, point_errors
from services.cli.evaluate.truth_track import hand_track

CAMERA = Camera("left", (640, 480), pinhole((640, 480), np.deg2rad(62.5)), np.zeros(5), np.eye(4))
ROW_TIME_NS = 30_000.0


@pytest.fixture(scope="module")
def scene(made_up):
    track = hand_track(made_up.truths(), "right")
    return made_up, track, landmark_truth(made_up.model, track, BASIC_LANDMARKS)


def place(made_up, name, t_s):
    rotation, position, angles = made_up.state(t_s)
    return landmark_point(made_up.model, name, *forward(made_up.model, rotation, position, angles))


def marker(made_up, name, t_s, shift_px=(0.0, 0.0)):
    y = 0.0
    for _ in range(5):  # the row decides the instant, and the instant the row
        x, y = CAMERA.project(place(made_up, name, t_s + y * ROW_TIME_NS * 1e-9))[0]
    return Marker(
        color=name,
        x_px=x + shift_px[0],
        y_px=y + shift_px[1],
        area_px=99.0,
        sigma_px=0.1,
        quality=1.0,
    )


def frame(made_up, i, markers):
    stamp_ns = made_up.truth(i / 30).stamp_ns
    return MarkerFrame(
        camera="left",
        seq=i,
        stamp_ns=stamp_ns + 777,
        row_time_ns=ROW_TIME_NS,
        clock_offset_ns=777,
        clock_sigma_ns=0,
        size_px=(640, 480),
        markers=markers,
    )


def test_the_landmarks_truth_is_that_of_the_hand_model(scene):
    made_up, track, points = scene
    joints = forward(
        made_up.model,
        rotation_from_quaternion(track.wrist_wxyz[7]),
        track.wrist_m[7],
        track.angles_rad[7],
    )
    assert np.allclose(
        points["thumb_tip"][7], landmark_point(made_up.model, "thumb_tip", *joints), atol=1e-9
    )


def test_markers_are_compared_at_their_own_rows_instant(scene):
    made_up, track, points = scene
    frames = [
        frame(made_up, i, [marker(made_up, "index_tip", i / 30, (0.5, -0.25))])
        for i in range(5, 80)
    ]
    found = marker_errors(
        frames, {"left": CAMERA}, {name: name for name in BASIC_LANDMARKS}, track.stamps_ns, points
    )["left"]
    assert found["index_tip"].bias_px == pytest.approx((0.5, -0.25), abs=0.02)
    assert found["index_tip"].rms_px == pytest.approx((0.5, 0.25), abs=0.02)
    assert found["index_tip"].found_share == 1.0
    assert found["ring_tip"].found_share == 0.0


def test_a_blob_elsewhere_is_a_stray_and_not_an_error(scene):
    made_up, track, points = scene
    frames = [
        frame(made_up, i, [marker(made_up, "index_tip", i / 30, (100.0 if i == 9 else 0.0, 0.0))])
        for i in range(5, 25)
    ]
    found = marker_errors(
        frames, {"left": CAMERA}, {"index_tip": "index_tip"}, track.stamps_ns, points
    )["left"]["index_tip"]
    assert found.strays == 1
    assert max(found.rms_px) < 0.02


def test_unknown_colours_and_cameras_are_left_out(scene):
    made_up, track, points = scene
    one = frame(made_up, 9, [marker(made_up, "index_tip", 0.3)])
    assert marker_errors([one], {}, {}, track.stamps_ns, points) == {}
    assert (
        marker_errors([one], {"left": CAMERA}, {}, track.stamps_ns, points)["left"][
            "index_tip"
        ].found_share
        == 0.0
    )


def test_points_are_compared_with_the_landmark_not_the_joint(scene):
    made_up, track, points = scene
    lines = []
    for i in range(5, 25):
        x, y, z = place(made_up, "ring_tip", i / 30)
        point = HandPoint(
            name="ring_tip",
            position_m=(x, y, z + 0.002),
            sigma_m=(1e-3,) * 3,
            cameras=["left"],
            source="predicted" if i < 10 else "measured",
        )
        lines.append(
            HandPoints(
                hand="right",
                seq=i,
                stamp_ns=made_up.truth(i / 30).stamp_ns,
                points=[point] if i % 2 else [],
            )
        )
    found = point_errors(lines, track.stamps_ns, points)
    assert list(found) == ["ring_tip"]
    assert found["ring_tip"].error.bias_mm == pytest.approx((0.0, 0.0, 2.0), abs=1e-3)
    assert found["ring_tip"].found_share == 0.5
    assert found["ring_tip"].predicted_share == 0.3
