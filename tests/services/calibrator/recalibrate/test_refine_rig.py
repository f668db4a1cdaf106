"""Places of a rig whose camera was bumped, recovered from moving markers.

And recordings that must be refused.
"""

from __future__ import annotations

import dataclasses

import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.geometry.transforms import inverse, rotation_from_vector, transform
from rhot.messages import Marker
from services.calibrator.output.report import refined_text
from services.calibrator.recalibrate.marker_tracks import recording
from services.calibrator.recalibrate.refine_rig import Wand, refine_rig
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

# The right camera's clock runs 6 ms off the left one's beside what it announces; noise as of
# painted blobs.
SETUP = SyntheticRig(sigma_px=0.15, clock_error_s=0.003)
TURN_DEG, SHIFT_M = np.array([0.6, -0.8, 0.5]), np.array([0.003, -0.002, 0.002])
EVERYWHERE = MovingHand(distance_m=0.6, speed_m_s=0.6, hand_hz=(0.2, 0.6))
LENGTH_M = 0.2


def bumped(cameras, name="right"):
    """The calibration of before: the camera now stands elsewhere."""
    T = cameras[name].T_rig_from_camera
    moved = transform(T[:3, :3] @ rotation_from_vector(np.radians(TURN_DEG)), T[:3, 3] + SHIFT_M)
    return cameras | {name: dataclasses.replace(cameras[name], T_rig_from_camera=moved)}


def waved(seconds: float, setup: SyntheticRig = SETUP, seed: int = 1):
    """Frames of a wand of two colours, turned and moved before the cameras."""
    random, path = np.random.default_rng(seed), dataclasses.replace(EVERYWHERE, seed=seed)
    found = []
    for n, camera in enumerate(setup.rig().values()):
        for k in range(int(seconds * 30)):
            time_s, pixels = k / 30.0 + n * setup.phase_s, []
            for end in (-0.5, 0.5):
                at_s = time_s + 0.008
                for _ in range(4):
                    angles = np.array([1.1 * np.sin(0.9 * at_s), 1.3 * np.sin(0.7 * at_s + 1.0)])
                    along = np.array(
                        [
                            np.cos(angles[0]) * np.cos(angles[1]),
                            np.sin(angles[0]),
                            np.cos(angles[0]) * np.sin(angles[1]),
                        ]
                    )
                    x, y = camera.project(
                        (path(np.array([at_s]))[0, 0] + [0.0, -0.09, 0.0] + end * LENGTH_M * along)[
                            None
                        ]
                    )[0]
                    at_s = time_s + y * setup.row_time_ns * 1e-9
                pixels.append(np.array([x, y]) + random.normal(0.0, setup.sigma_px, 2))
            markers = [
                Marker(
                    color=color,
                    x_px=float(x),
                    y_px=float(y),
                    area_px=80.0,
                    sigma_px=0.1,
                    quality=1.0,
                )
                for color, (x, y) in zip(("blue", "lime"), pixels, strict=True)
                if 0 <= x < 640 and 0 <= y < 480
            ]
            frame = frames(setup, path, 0.01)[0]
            stamp_ns = START_NS + round(time_s * 1e9)
            found.append(
                msgspec.structs.replace(
                    frame,
                    camera=camera.name,
                    seq=k,
                    stamp_ns=stamp_ns,
                    clock_offset_ns=0,
                    markers=markers,
                )
            )
    return sorted(found, key=lambda frame: frame.stamp_ns)


def test_a_hand_tells_the_turn_and_the_direction_of_the_shift():
    old = bumped(SETUP.rig())
    result = refine_rig(recording(frames(SETUP, EVERYWHERE, 10.0), old), old)
    moved = result.moved["right"]
    # Half a metre away .02 deg of vergence are 1 mm of depth.
    np.testing.assert_allclose(moved.turned_deg, -TURN_DEG, atol=0.02)
    np.testing.assert_allclose(moved.shifted_mm[1:], -1e3 * SHIFT_M[1:], atol=0.1)
    assert moved.late_ms == pytest.approx(6.0, abs=0.1)
    # Without a wand the distance of the cameras stays what it was.
    kept, was = (
        np.linalg.norm(cameras["right"].centre_rig - cameras["left"].centre_rig)
        for cameras in (result.cameras, old)
    )
    assert kept == pytest.approx(was, abs=1e-6)
    assert result.epipolar_px < 0.3 < 3.0 < result.epipolar_before_px
    np.testing.assert_array_equal(
        result.cameras["left"].T_rig_from_camera, old["left"].T_rig_from_camera
    )
    assert "scale" in refined_text(result)


def test_a_wand_tells_the_scale_too():
    old = bumped(SETUP.rig())
    result = refine_rig(recording(waved(18.0), old), old, Wand("blue", "lime", LENGTH_M))
    moved = result.moved["right"]
    np.testing.assert_allclose(moved.turned_deg, -TURN_DEG, atol=0.05)
    # 3 mm along the baseline are 4 % of scale: found, not kept.
    np.testing.assert_allclose(moved.shifted_mm, -1e3 * SHIFT_M, atol=0.2)
    assert result.wand_mm is not None
    assert result.wand_mm[1] < 0.2 * result.wand_mm[0]
    assert "held-out wand" in refined_text(result)


def test_three_cameras_of_which_one_was_bumped():
    setup = SyntheticRig(cameras=3, sigma_px=0.15)
    old = bumped(setup.rig(), "camera3")
    result = refine_rig(recording(frames(setup, EVERYWHERE, 12.0), old), old)
    np.testing.assert_allclose(result.moved["camera3"].turned_deg, -TURN_DEG, atol=0.03)
    np.testing.assert_allclose(result.moved["right"].turned_deg, 0.0, atol=0.02)
    # The scale is the first two cameras', so all of the third's shift is found.
    np.testing.assert_allclose(result.moved["camera3"].shifted_mm, -1e3 * SHIFT_M, atol=0.5)


def test_wrong_markers_now_and_then_do_not_matter():
    old, random = bumped(SETUP.rig()), np.random.default_rng(3)
    given = [
        msgspec.structs.replace(
            frame,
            markers=[
                msgspec.structs.replace(
                    m, x_px=m.x_px * (random.uniform() if random.uniform() < 0.01 else 1.0)
                )
                for m in frame.markers
            ],
        )
        for frame in frames(SETUP, EVERYWHERE, 10.0)
    ]
    result = refine_rig(recording(given, old), old)
    np.testing.assert_allclose(result.moved["right"].turned_deg, -TURN_DEG, atol=0.05)


@pytest.mark.parametrize(
    ("path", "seconds", "reason"),
    [
        (EVERYWHERE, 2.0, "half a minute"),
        (MovingHand(distance_m=0.6, speed_m_s=0.02), 8.0, "near and far"),
    ],
)
def test_recordings_that_cannot_tell_are_refused(path, seconds, reason):
    old = bumped(SETUP.rig())
    with pytest.raises(CalibrationError, match=reason):
        refine_rig(recording(frames(SETUP, path, seconds), old), old)


def test_a_rig_that_is_right_is_left_alone_or_hardly_moved():
    sound = SETUP.rig()
    try:
        result = refine_rig(recording(frames(SETUP, EVERYWHERE, 12.0), sound), sound)
    except CalibrationError as error:
        assert "nothing to refine" in str(error)  # noqa: PT017
        return
    assert np.abs(result.moved["right"].turned_deg).max() < 0.02
    T = inverse(sound["right"].T_rig_from_camera) @ result.cameras["right"].T_rig_from_camera
    assert np.linalg.norm(T[:3, 3]) < 2e-4


@pytest.mark.parametrize(
    "wand", [Wand("blue", "blue", 0.2), Wand("blue", "gold", 0.2), Wand("blue", "lime", 200.0)]
)
def test_impossible_wands_are_refused(wand):
    old = SETUP.rig()
    with pytest.raises(CalibrationError, match="cannot be used"):
        refine_rig(recording(frames(SETUP, EVERYWHERE, 1.0), old), old, wand)


def test_another_picture_size_is_refused():
    old = SETUP.rig()
    given = [
        msgspec.structs.replace(frame, size_px=(1280, 960))
        for frame in frames(SETUP, EVERYWHERE, 0.2)
    ]
    with pytest.raises(CalibrationError, match="1280x960"):
        recording(given, old)


def test_an_empty_recording_is_refused():
    old = SETUP.rig()
    with pytest.raises(CalibrationError, match="followed markers at 0"):
        refine_rig(recording([], old), old)
