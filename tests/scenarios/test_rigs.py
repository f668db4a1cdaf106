"""Rigs larger than two cameras and a hand: three and four cameras, and two hands."""

from __future__ import annotations

import dataclasses
import time
from collections import defaultdict

import msgspec
import numpy as np
import pytest

from rhot.files.calibration import load_hand
from rhot.files.config import load_rig
from rhot.files.rig_tables import Fusion, HandTable
from rhot.hand import BASIC_LANDMARKS, landmark_point
from services.fusion.step import FusionStep
from services.simulator.scene.catalog import SCENES
from services.simulator.scene.scene import build_scene
from testing.rendered_markers import detect
from testing.synthetic_points import COLORS, START_NS, MovingHand, SyntheticRig, frames, point_hands

OTHERS = ("yellow", "orange", "red", "pink", "white", "black")


@dataclasses.dataclass(frozen=True)
class Shifted(MovingHand):
    """The same hand elsewhere."""

    shift_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __call__(self, times_s):
        return super().__call__(times_s) + np.array(self.shift_m)


@pytest.mark.parametrize("cameras", [3, 4])
def test_one_of_many_cameras_may_stop_unnoticed(cameras, run_fusion):
    """Expected: from 2 s to 4 s without the last camera all points are measured.

    With it again they are as exact as before.
    """
    setup = SyntheticRig(
        cameras=cameras, phase_s=1.0 / (30.0 * cameras), clock_error_s=0.0, clock_sigma_s=1e-4
    )
    gone = setup.names[-1]
    arriving = [
        f
        for f in frames(setup, MovingHand(), 6.0)
        if f.camera != gone or not 2e9 <= f.stamp_ns - f.clock_offset_ns - START_NS < 4e9
    ]
    _, reported = run_fusion(setup, arriving, MovingHand(), Fusion(lag_frames=1))
    assert reported.share(2.0, 4.0, measured=True) > 0.95
    assert reported.rms_mm(4.2, 6.0) < 1.1 * reported.rms_mm(1.0, 2.0) + 0.2
    assert reported.outlier_share() < 0.005


def two_hands(setup: SyntheticRig, right: MovingHand, left: MovingHand, seconds: float):
    """Both hands before one rig: frames of equal seeds, markers of both."""
    rename = dict(zip(COLORS, OTHERS, strict=True))
    for a, b in zip(frames(setup, right, seconds), frames(setup, left, seconds), strict=True):
        yield msgspec.structs.replace(
            a,
            markers=a.markers
            + [msgspec.structs.replace(m, color=rename[m.color]) for m in b.markers],
        )


def test_two_hands_side_by_side_are_kept_apart():
    setup = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4)
    right, left = (
        Shifted(speed_m_s=0.25, shift_m=(-0.13, 0.0, 0.0)),
        Shifted(speed_m_s=0.25, shift_m=(0.13, 0.0, 0.05), seed=2),
    )
    tables = {
        hand: HandTable(markers=dict(zip(BASIC_LANDMARKS, colors, strict=True)))
        for hand, colors in (("right", COLORS), ("left", OTHERS))
    }
    config = msgspec.structs.replace(setup.config(), hand=tables)
    model = point_hands()["right"]
    step = FusionStep(
        config, setup.rig(), {"right": model, "left": msgspec.structs.replace(model, hand="left")}
    )
    errors = defaultdict(list)
    for frame in two_hands(setup, right, left, 4.0):
        for message in step.step(frame):
            at_s = (message.stamp_ns - START_NS) * 1e-9
            truth = (right if message.hand == "right" else left)(np.array([at_s]))[0]
            errors[message.hand] += [
                np.subtract(p.position_m, truth[BASIC_LANDMARKS.index(p.name)])
                for p in message.points
                if at_s > 1.0
            ]
    for hand in ("right", "left"):
        assert len(errors[hand]) > 0.95 * 6 * 89
        assert 1e3 * np.sqrt(np.mean(np.sum(np.square(errors[hand]), axis=1))) < 2.5


def test_two_hands_in_pictures(repository):
    """The scene `two_hands`, three colours each, through the tracker: every landmark of both within
    5.5 mm RMS: the left little finger, which plays, is 5.1 off, the others 3.2 at most.
    """
    config = load_rig(repository / "config" / "sim.toml")
    right, left = ("violet", "magenta", "blue"), ("cyan", "green", "lime")
    names = ("wrist", "index_tip", "little_tip")
    tables = {
        hand: HandTable(markers=dict(zip(names, colors, strict=True)))
        for hand, colors in (("right", right), ("left", left))
    }
    config = msgspec.structs.replace(config, hand=tables)
    scene = build_scene(
        config, dataclasses.replace(SCENES["two_hands"], distance_m=0.6), "two_hands", 1
    )
    hands = {hand: load_hand(config.calibration_dir, hand, 1.0) for hand in tables}
    step, errors = FusionStep(config, scene.cameras, hands), defaultdict(list)
    for frame in detect(config, scene, 1.5):
        for message in step.step(frame):
            at_s = (message.stamp_ns - START_NS) * 1e-9
            if at_s < 0.3:
                continue
            joints = scene.hands[message.hand].joints(scene.hand_states(at_s)[message.hand])
            for point in message.points:
                truth = landmark_point(hands[message.hand], point.name, *joints)
                errors[message.hand, point.name].append(np.subtract(point.position_m, truth))
    assert set(errors) == {(hand, name) for hand in tables for name in names}
    for entries in errors.values():
        assert len(entries) > 30
        assert 1e3 * np.sqrt(np.mean(np.sum(np.square(entries), axis=1))) < 5.5


def test_four_cameras_at_90_fps_leave_most_of_a_core_free():
    """Issue 4: 70 % free; measured: 4-6 % used.

    The limit here leaves room for a machine that is busy with other tests.
    """
    setup = SyntheticRig(cameras=4, fps=90.0, phase_s=1.0 / 360.0)
    step = FusionStep(setup.config(), setup.rig(), point_hands())
    given, took_s = frames(setup, MovingHand(), 3.0), 0.0
    for number, frame in enumerate(given):
        begin_s = time.process_time()
        step.step(frame)
        took_s += (time.process_time() - begin_s) if number >= 90 else 0.0
    assert took_s / (3.0 * (len(given) - 90) / len(given)) < 0.3
