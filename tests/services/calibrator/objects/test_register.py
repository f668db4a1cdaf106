"""Registration of lighthouses to the rig from synthetic recordings, and those it must refuse."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from rhot.errors import CalibrationError
from rhot.geometry.transforms import angle_between, apply, inverse
from services.calibrator.objects.register import register
from services.calibrator.objects.sightings import sightings
from services.calibrator.objects.tracker_path import tracker_path
from testing.synthetic_points import SyntheticRig
from testing.synthetic_tracker import COLOR, SERIAL, Lighthouse, TrackerMotion, painted_frames

MARKER_M = (0.012, 0.030, -0.025)
RIG = SyntheticRig(sigma_px=0.3)
FAR = {"middle_m": (0.04, 0.0, 1.1), "size_m": (0.7, 0.6, 0.6)}


def recorded(motion, lighthouse, rig=RIG, seconds=20.0, serial=SERIAL, marker_m=MARKER_M):
    """What `register` takes: sightings and paths by serial."""
    frames = painted_frames(rig, motion, marker_m, seconds)
    seen = sightings(frames, rig.rig(), COLOR)
    return {serial: seen}, {serial: tracker_path(lighthouse.poses(motion, seconds, serial))}


def errors(found, motion, lighthouse):
    """Median error (mm) over the volume, of the turn (deg) and of the time offset (ms)."""
    T = lighthouse.T_rig_from_lighthouse()
    points = motion(np.linspace(0.0, 20.0, 200))[0]
    off = apply(found.T_rig_from_lighthouse, apply(inverse(T), points)) - points
    turn = np.degrees(angle_between(found.T_rig_from_lighthouse[:3, :3], T[:3, :3]))
    late_ms = 1e-6 * next(iter(found.trackers.values())).time_offset_ns - 1e3 * lighthouse.late_s
    return 1e3 * float(np.median(np.linalg.norm(off, axis=1))), turn, late_ms


@pytest.mark.parametrize("volume", [{}, FAR], ids=["near", "far"])
def test_noise_outliers_and_a_late_clock_leave_less_than_a_millimetre(volume):
    for seed in (1, 2):
        motion, lighthouse = TrackerMotion(seed=seed, **volume), Lighthouse(seed=seed)
        found = register(*recorded(motion, lighthouse))
        mm, deg, late_ms = errors(found, motion, lighthouse)
        assert mm < 0.75
        assert deg < 0.1
        assert abs(late_ms) < 1.0
        place = found.trackers[SERIAL]
        assert np.linalg.norm(place.marker_m - MARKER_M) < 1e-3
        assert found.rejected_poses > 0.03 * 20 * 90
        # The error is of the size that the covariance says.
        assert mm < 1e3 * 3.0 * found.sigma_m
        assert found.held_out.px < 1.2 * found.residual.px


def test_what_light_moves_paint_by_is_told():
    # As large as a bead of 2 cm half a metre away, lit from above: what is seen is nearer to the
    # light by .03 of its radius along each of two axes, always.
    motion, lighthouse, shift_m = TrackerMotion(), Lighthouse(noise_m=1e-4), (0.0, -3e-4, -3e-4)
    lit = replace(motion, middle_m=tuple(np.add(motion.middle_m, shift_m).tolist()))
    focal_px = float(np.mean(next(iter(RIG.rig().values())).focal_px))
    area_px = np.pi * (0.01 * focal_px / motion.middle_m[2]) ** 2
    seen, paths = recorded(lit, lighthouse)
    seen[SERIAL] = replace(seen[SERIAL], area_px=np.full(len(seen[SERIAL]), area_px))
    paths[SERIAL] = recorded(motion, lighthouse)[1][SERIAL]
    found = register(seen, paths)
    mm, _, _ = errors(found, motion, lighthouse)
    assert 0.3 < mm < 2.0e3 * found.sigma_m
    assert 0.9 * 3e-4 * 3**0.5 < found.sigma_m < 1e-3


@pytest.mark.parametrize("rate_hz", [60.0, 90.0, 120.0, 250.0])
def test_noise_makes_no_stamps_late_however_many_poses_there_are(rate_hz):
    motion = TrackerMotion(hz=(0.1, 0.4))
    lighthouse = Lighthouse(noise_m=3e-3, rate_hz=rate_hz)
    found = register(*recorded(motion, lighthouse))
    _, _, late_ms = errors(found, motion, lighthouse)
    assert abs(late_ms) < 1.5


def test_without_noise_it_is_exact():
    motion = TrackerMotion()
    lighthouse = Lighthouse(noise_m=0.0, noise_rad=0.0, outliers=0.0, late_s=-0.21)
    rig = replace(RIG, sigma_px=0.001, clock_error_s=0.0)
    found = register(*recorded(motion, lighthouse, rig))
    mm, deg, late_ms = errors(found, motion, lighthouse)
    assert mm < 0.05
    assert deg < 0.01
    assert abs(late_ms) < 0.05


def test_two_trackers_share_one_frame():
    lighthouse, other = Lighthouse(), replace(Lighthouse(), late_s=-0.011)
    motion, second = TrackerMotion(), TrackerMotion(seed=5)
    seen, paths = recorded(motion, lighthouse)
    more_seen, more_paths = recorded(second, other, serial="LHR-2", marker_m=(0.0, 0.02, 0.03))
    found = register(seen | more_seen, paths | more_paths)
    mm, deg, late_ms = errors(found, motion, lighthouse)
    assert mm < 0.5
    assert deg < 0.1
    assert abs(late_ms) < 1.0
    assert found.trackers["LHR-2"].time_offset_ns == pytest.approx(-11e6, abs=1e6)
    assert found.trackers["LHR-2"].marker_m == pytest.approx([0.0, 0.02, 0.03], abs=1e-3)


WEAK = {
    "turned about one axis": ({"turn_rad": (0.0, 0.8, 0.0)}, "about one axis"),
    "not turned": ({"turn_rad": (0.0, 0.0, 0.0)}, "about one axis"),
    "a plane": ({"size_m": (0.3, 0.3, 0.0)}, "in a plane"),
    "a line": ({"size_m": (0.4, 0.0, 0.0)}, "on a line"),
}


@pytest.mark.parametrize("case", WEAK)
def test_motion_that_cannot_tell_is_refused_with_the_reason(case):
    change, reason = WEAK[case]
    motion = TrackerMotion(**change)
    # Paint on the axis: away from it, it would draw a volume of its own.
    with pytest.raises(CalibrationError, match=reason):
        register(*recorded(motion, Lighthouse(), marker_m=(0.0, 0.005, 0.0)))


def test_too_short_is_refused():
    with pytest.raises(CalibrationError, match="record 20 s"):
        register(*recorded(TrackerMotion(), Lighthouse(), seconds=5.0))


def test_paint_that_one_camera_or_none_sees_is_refused():
    seen, paths = recorded(TrackerMotion(), Lighthouse())
    left = seen[SERIAL].only(seen[SERIAL].camera == 0)
    with pytest.raises(CalibrationError, match=r"two cameras must see .*right 0"):
        register({SERIAL: left}, paths)
    with pytest.raises(CalibrationError, match="no camera saw 'orange' paint"):
        register({SERIAL: left.only(left.camera == 1)}, paths)


def test_swapped_trackers_are_told_apart():
    lighthouse = Lighthouse()
    seen, paths = recorded(TrackerMotion(), lighthouse)
    other = tracker_path(lighthouse.poses(TrackerMotion(seed=9), 20.0, "LHR-other"))
    both = {SERIAL: other, "LHR-other": paths[SERIAL]}
    with pytest.raises(CalibrationError, match="is on tracker LHR-other, not on LHR-0A1B2C3D"):
        register(seen, both)
    with pytest.raises(CalibrationError, match="does not move as tracker"):
        register(seen, {SERIAL: other})


def test_a_tracker_that_is_not_there_is_named():
    seen, paths = recorded(TrackerMotion(), Lighthouse())
    with pytest.raises(CalibrationError, match=r"tracker LHR-lost .* Tracked were: LHR-0A1B2C3D"):
        register({"LHR-lost": seen[SERIAL]}, paths)


def test_a_change_of_universe_is_refused():
    poses = Lighthouse().poses(TrackerMotion(), 2.0)
    poses[50:] = [msgspec.structs.replace(pose, universe="2") for pose in poses[50:]]
    with pytest.raises(CalibrationError, match="changed its universe"):
        tracker_path(poses)


def test_a_jump_of_the_lighthouse_and_a_second_blob_do_not_move_it():
    motion, lighthouse = TrackerMotion(), Lighthouse()
    poses = lighthouse.poses(motion, 20.0)
    for k in range(450, 630):
        rows = np.array(poses[k].mDeviceToAbsoluteTracking)
        rows[:, 3] += [0.1, 0.0, 0.05]
        poses[k] = msgspec.structs.replace(poses[k], mDeviceToAbsoluteTracking=rows.tolist())
    frames = painted_frames(RIG, motion, MARKER_M, 20.0)
    spot = msgspec.structs.replace(frames[0].markers[0], x_px=500.0, y_px=100.0)
    frames = [
        msgspec.structs.replace(frame, markers=[*frame.markers, spot])
        if frame.camera == "left"
        else frame
        for frame in frames
    ]
    seen = {SERIAL: sightings(frames, RIG.rig(), COLOR)}
    found = register(seen, {SERIAL: tracker_path(poses)})
    mm, deg, late_ms = errors(found, motion, lighthouse)
    assert mm < 0.75
    assert deg < 0.1
    assert abs(late_ms) < 1.0
    assert found.rejected > 500
    assert found.held_out.px < 1.3 * found.residual.px


def test_an_error_that_lasts_is_told_from_the_cameras_noise():
    motion, lighthouse = TrackerMotion(), Lighthouse(correlation_s=0.5)
    found = register(*recorded(motion, lighthouse))
    mm, _, _ = errors(found, motion, lighthouse)
    assert mm < 1.5
    assert mm < 1e3 * 3.0 * found.sigma_m
    assert 0.2 < found.noise.tau_s < 1.2
    assert 0.6e-3 < found.noise.tracker_m < 1.6e-3
