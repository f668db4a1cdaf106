"""Extrinsics of a rig whose camera was bumped, refined from moving markers.

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
from services.calibrator.recalibrate.marker_tracks import build_tracks
from services.calibrator.recalibrate.refine_rig import Wand, refine_rig
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames

# The right camera's clock is 6 ms off the left one's beyond what it announces; noise as of painted
# blobs.
SETUP = SyntheticRig(sigma_px=0.15, clock_error_s=0.003)
TURN_DEG, SHIFT_M = np.array([0.6, -0.8, 0.5]), np.array([0.003, -0.002, 0.002])
EVERYWHERE = MovingHand(distance_m=0.6, speed_m_s=0.6, hand_hz=(0.2, 0.6))
LENGTH_M = 0.2


def bumped(cameras, name="right"):
    """The calibration of before: the camera now stands elsewhere."""
    T = cameras[name].T_rig_from_camera
    R = T[:3, :3] @ rotation_from_vector(np.radians(TURN_DEG))
    moved = transform(R, T[:3, 3] + SHIFT_M)
    return cameras | {name: dataclasses.replace(cameras[name], T_rig_from_camera=moved)}


def waved(seconds: float, setup: SyntheticRig = SETUP, random_seed: int = 1):
    """Frames of a wand of two colours, rotated and moved before the cameras."""
    random = np.random.default_rng(random_seed)
    path = dataclasses.replace(EVERYWHERE, seed=random_seed)
    template = frames(setup, path, 0.01)[0]
    found = []
    for n, camera in enumerate(setup.rig().values()):
        for k in range(int(seconds * 30)):
            time_s, markers = k / 30.0 + n * setup.phase_s, []
            for color, end in (("blue", -0.5), ("lime", 0.5)):
                exact = end_px(camera, setup, path, time_s, end)
                x, y = exact + random.normal(0.0, setup.sigma_px, 2)
                if 0 <= x < 640 and 0 <= y < 480:
                    markers.append(marker(color, x, y))
            frame = msgspec.structs.replace(
                template,
                camera=camera.name,
                seq=k,
                stamp_ns=START_NS + round(time_s * 1e9),
                clock_offset_ns=0,
                markers=markers,
            )
            found.append(frame)
    return sorted(found, key=lambda frame: frame.stamp_ns)


def end_px(camera, setup: SyntheticRig, path: MovingHand, time_s: float, end: float):
    """Where a rolling shutter sees one end (-.5 or .5) of the wand; its row tells the time."""
    at_s, pixel = time_s + 0.008, np.zeros(2)
    for _ in range(4):
        a, b = 1.1 * np.sin(0.9 * at_s), 1.3 * np.sin(0.7 * at_s + 1.0)
        along = np.array([np.cos(a) * np.cos(b), np.sin(a), np.cos(a) * np.sin(b)])
        middle = path(np.array([at_s]))[0, 0] + [0.0, -0.09, 0.0]
        pixel = camera.project((middle + end * LENGTH_M * along)[None])[0]
        at_s = time_s + pixel[1] * setup.row_time_ns * 1e-9
    return pixel


def marker(color: str, x_px: float, y_px: float) -> Marker:
    return Marker(
        color=color,
        x_px=float(x_px),
        y_px=float(y_px),
        area_px=80.0,
        sigma_px=0.1,
        quality=1.0,
    )


def test_a_hand_gives_the_rotation_and_the_direction_of_the_shift():
    old = bumped(SETUP.rig())
    result = refine_rig(build_tracks(frames(SETUP, EVERYWHERE, 10.0), old), old)
    change = result.changes["right"]
    # Half a metre away .02 deg of vergence are 1 mm of depth.
    np.testing.assert_allclose(change.rotation_deg, -TURN_DEG, atol=0.02)
    np.testing.assert_allclose(change.shift_mm[1:], -1e3 * SHIFT_M[1:], atol=0.1)
    assert change.delay_ms == pytest.approx(6.0, abs=0.1)
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


def test_a_wand_gives_the_scale_too():
    old = bumped(SETUP.rig())
    result = refine_rig(build_tracks(waved(18.0), old), old, Wand("blue", "lime", LENGTH_M))
    change = result.changes["right"]
    np.testing.assert_allclose(change.rotation_deg, -TURN_DEG, atol=0.05)
    # 3 mm along the baseline are 4 % of scale: found, not kept.
    np.testing.assert_allclose(change.shift_mm, -1e3 * SHIFT_M, atol=0.2)
    assert result.wand_mm is not None
    assert result.wand_mm[1] < 0.2 * result.wand_mm[0]
    assert "held-out wand" in refined_text(result)


def test_three_cameras_of_which_one_was_bumped():
    setup = SyntheticRig(cameras=3, sigma_px=0.15)
    old = bumped(setup.rig(), "camera3")
    result = refine_rig(build_tracks(frames(setup, EVERYWHERE, 12.0), old), old)
    np.testing.assert_allclose(result.changes["camera3"].rotation_deg, -TURN_DEG, atol=0.03)
    np.testing.assert_allclose(result.changes["right"].rotation_deg, 0.0, atol=0.02)
    # The scale is the first two cameras', so all of the third's shift is found.
    np.testing.assert_allclose(result.changes["camera3"].shift_mm, -1e3 * SHIFT_M, atol=0.5)


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
    result = refine_rig(build_tracks(given, old), old)
    np.testing.assert_allclose(result.changes["right"].rotation_deg, -TURN_DEG, atol=0.05)


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
        refine_rig(build_tracks(frames(SETUP, path, seconds), old), old)


def test_a_rig_that_is_right_is_left_alone_or_hardly_moved():
    sound = SETUP.rig()
    try:
        result = refine_rig(build_tracks(frames(SETUP, EVERYWHERE, 12.0), sound), sound)
    except CalibrationError as error:
        assert "nothing to refine" in str(error)  # noqa: PT017
        return
    assert np.abs(result.changes["right"].rotation_deg).max() < 0.02
    T = inverse(sound["right"].T_rig_from_camera) @ result.cameras["right"].T_rig_from_camera
    assert np.linalg.norm(T[:3, 3]) < 2e-4


@pytest.mark.parametrize(
    "wand", [Wand("blue", "blue", 0.2), Wand("blue", "gold", 0.2), Wand("blue", "lime", 200.0)]
)
def test_impossible_wands_are_refused(wand):
    old = SETUP.rig()
    with pytest.raises(CalibrationError, match="cannot be used"):
        refine_rig(build_tracks(frames(SETUP, EVERYWHERE, 1.0), old), old, wand)


def test_another_picture_size_is_refused():
    old = SETUP.rig()
    given = [
        msgspec.structs.replace(frame, size_px=(1280, 960))
        for frame in frames(SETUP, EVERYWHERE, 0.2)
    ]
    with pytest.raises(CalibrationError, match="1280x960"):
        build_tracks(given, old)


def test_an_empty_recording_is_refused():
    old = SETUP.rig()
    with pytest.raises(CalibrationError, match="followed markers at 0"):
        refine_rig(build_tracks([], old), old)
