"""Clocks of whole recordings: put right, believed, contradicted or unknown, and said so."""

from __future__ import annotations

from contextlib import closing

import msgspec
import numpy as np
import pytest

from rhot.files.capture import read_lines, write_lines
from rhot.messages import HandPoints, MarkerFrame
from services.cli.offline.clocks.alignment import Clocks
from services.cli.offline.clocks.camera_clock import clock_text, warnings_of
from services.cli.offline.clocks.recorded_markers import RecordedMarkers
from services.cli.offline.inputs import job_of
from services.cli.offline.run import run
from testing.families.motions import stop_and_go
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames, point_hands

RIG = SyntheticRig(cameras=3, phase_s=1 / 90, clock_error_s=0.0, skew_s=0.0, drift_ppm=0.0)
MOTION = stop_and_go(14.0, 3)
FRAMES = frames(RIG, MOTION, 10.0)
NAMES = list(RIG.names)


def stamped(
    late_s: dict[str, float],
    given: list[MarkerFrame] = FRAMES,
    sigma_ns: int = -1,
    drift: float = 0.0,
    start_ns: int = START_NS,
) -> list[MarkerFrame]:
    """Frames by clocks that are late and, but for the first, adrift; in the order of their stamps.

    Frames before a clock's 0 are left out, as of a video that began then.
    """
    found = []
    for frame in given:
        since_s = (frame.stamp_ns - START_NS) * 1e-9
        here_s = since_s * (1.0 + drift * (frame.camera != NAMES[0])) + late_s.get(frame.camera, 0)
        if here_s >= 0.0:
            stamp_ns = start_ns + round(1e9 * here_s)
            clock = {"clock_offset_ns": 0, "clock_sigma_ns": sigma_ns}
            found.append(msgspec.structs.replace(frame, stamp_ns=stamp_ns, **clock))
    return sorted(found, key=lambda frame: (frame.stamp_ns, frame.camera))


def clocks_of(given, folder, names=NAMES, by_hand=None, *, tune=True, calibrated=True):
    """The verdicts on a recording, and its frames put right."""
    with closing(RecordedMarkers(folder)) as recorded:
        for frame in given:
            if frame.camera in names:
                recorded.add(frame)
        clocks = Clocks(recorded, names)
        clocks.find(RIG.rig() if calibrated else None, names, by_hand or {}, tune=tune)
        return clocks, list(clocks.frames())


def right_s(frame: MarkerFrame) -> float:
    return (frame.stamp_ns - frame.clock_offset_ns) * 1e-9


def test_clocks_without_anything_in_common_are_put_right(tmp_path):
    given = stamped({"right": -3.3, "camera3": 2.7}, drift=1e-4)
    clocks, frames_ = clocks_of(given, tmp_path)
    assert [one.verdict for one in clocks.told] == ["aligned", "aligned"]
    assert clocks.worth_telling
    assert clocks.warnings == []
    assert len(frames_) == len(given)
    assert [right_s(frame) for frame in frames_] == sorted(map(right_s, frames_))
    true_s = {(frame.camera, frame.seq): frame.stamp_ns * 1e-9 for frame in FRAMES}
    for frame in frames_:
        assert right_s(frame) == pytest.approx(true_s[frame.camera, frame.seq], abs=1e-3)
        assert 0 < frame.clock_sigma_ns < 2_000_000
    text = clock_text(clocks.told[0])
    assert "right's times are 3.29" in text
    assert "earlier than left's" in text


def test_no_instant_is_before_time_begins(tmp_path):
    """Videos begin at 0; what was before the first one's beginning must have an instant too."""
    given = stamped({"left": -3.0, "right": 0.0}, start_ns=0)
    clocks, frames_ = clocks_of(given, tmp_path, ["left", "right"])
    assert clocks.told[0].used_offset_s == pytest.approx(3.0, abs=1e-3)
    assert min(map(right_s, frames_)) >= 0.0
    assert clocks.told[0].at_s > 0.0


@pytest.mark.parametrize("late_s", [0.0, 0.004])
def test_stamps_that_the_markers_agree_with_stay_as_they_are(tmp_path, late_s):
    given = stamped({"right": late_s}, sigma_ns=500_000)
    clocks, frames_ = clocks_of(given, tmp_path, ["left", "right"])
    assert [one.verdict for one in clocks.told] == ["as stamped"]
    assert not clocks.worth_telling
    assert frames_ == [frame for frame in given if frame.camera != "camera3"]


def test_stamps_that_the_markers_contradict_are_put_right_with_a_warning(tmp_path):
    given = stamped({"right": 0.137}, sigma_ns=500_000)
    clocks, frames_ = clocks_of(given, tmp_path, ["left", "right"])
    assert clocks.told[0].verdict == "corrected"
    assert (
        "contradict the markers' motion and are put right: right's times are 0.13"
        in (clocks.warnings[0])
    )
    kept, same = clocks_of(given, tmp_path, ["left", "right"], tune=False)
    assert kept.told[0].verdict == "contradicted"
    assert "tune_clocks = false" in kept.warnings[0]
    assert same != frames_


def test_an_offset_by_hand_holds_and_a_wrong_one_is_told(tmp_path):
    given = stamped({"right": 0.5})
    good, frames_ = clocks_of(given, tmp_path, ["left", "right"], {"right": 0.5})
    assert (good.told[0].verdict, good.warnings) == ("by hand", [])
    right = next(frame for frame in frames_ if frame.camera == "right")
    assert (right.clock_offset_ns, right.clock_sigma_ns) == (500_000_000, -1)
    wrong, _ = clocks_of(given, tmp_path, ["left", "right"], {"right": 0.2})
    assert wrong.told[0].used_offset_s == 0.2
    assert (
        "--offset right=0.2 contradicts the markers' motion: right's times are 0.5"
        in (wrong.warnings[0])
    )


def test_what_cannot_be_told_is_said(tmp_path):
    still = stamped({"right": 0.5}, frames(RIG, MovingHand(speed_m_s=0.0), 4.0))
    clocks, frames_ = clocks_of(still, tmp_path, ["left", "right"])
    assert clocks.told[0].verdict == "unknown"
    assert "nothing moves that both see" in clocks.warnings[0]
    assert "--offset right=SECONDS" in clocks.warnings[0]
    assert {frame.clock_offset_ns for frame in frames_} == {0}
    blind, _ = clocks_of(still, tmp_path, ["left", "right"], calibrated=False)
    assert "not calibrated together" in warnings_of(blind.told[0])[0]


def test_of_a_motion_that_repeats_itself_the_likeliest_offset_is_taken_with_a_warning(tmp_path):
    """Else the recordings would be taken to begin together, which no motion speaks for."""
    period_s = 3.0

    class Waves(MovingHand):
        def __call__(self, times_s):
            # To and fro, so that it does not leap.
            return super().__call__(np.abs((times_s / period_s - 0.5) % 1.0 - 0.5) * period_s)

    given = stamped({"right": 0.5}, frames(RIG, Waves(speed_m_s=0.4), 12.0))
    clocks, frames_ = clocks_of(given, tmp_path, ["left", "right"])
    (told,) = clocks.told
    assert (told.verdict, told.found) == ("likeliest", False)
    periods = (told.used_offset_s - 0.5) / period_s
    assert periods == pytest.approx(round(periods), abs=0.003)
    assert "repeats itself: two offsets fit" in clocks.warnings[0]
    assert "--offset right=SECONDS" in clocks.warnings[0]
    assert {frame.clock_offset_ns for frame in frames_ if frame.camera == "right"} != {0}


def capture(folder, given: list[MarkerFrame]):
    """A capture of markers alone; what `rhot track` makes of it."""
    (folder / "calibration").mkdir(parents=True)
    RIG.save_calibration(folder / "calibration")
    markers = "".join(f'{name} = "{c}"\n' for name, c in RIG.config().hand["right"].markers.items())
    (folder / "rig.toml").write_text(
        '[rig]\nname = "r"\n[[camera]]\nname = "left"\n[[camera]]\nname = "right"\n'
        f"[hand.right.markers]\n{markers}"
    )
    write_lines(folder / "markers.jsonl", [f for f in given if f.camera != "camera3"])
    return run(job_of([str(folder)], None), folder / "out")


def rms_m(folder, from_s: float) -> float:
    """The error of what two cameras see, for which time begins from_s before START_NS."""
    errors = []
    for message in read_lines(folder / "out" / "points.jsonl", HandPoints):
        truth = MOTION(np.array([(message.stamp_ns - START_NS) * 1e-9 - from_s]))[0]
        names = list(RIG.config().hand["right"].markers)
        errors += [
            np.subtract(point.position_m, truth[names.index(point.name)])
            for point in message.points
            if len(point.cameras) == 2
        ]
    assert len(errors) > 400
    return float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))


def test_points_of_shifted_videos_are_nearly_as_good_as_of_aligned_ones(tmp_path, monkeypatch):
    # These markers are points: a hand's paint would be taken to lie beside its joints.
    monkeypatch.setattr(
        "services.cli.offline.pipeline.load_hand", lambda *_: point_hands()["right"]
    )
    given = frames(RIG, MOTION, 6.0)
    aligned = capture(tmp_path / "aligned", stamped({}, given, 500_000))
    assert aligned.clocks is msgspec.UNSET
    shifted = capture(tmp_path / "shifted", stamped({"right": -0.52}, given, drift=1e-4))
    assert shifted.complete
    assert shifted.clocks[0].verdict == "aligned"
    assert b'"offset_s": -0.519' in (tmp_path / "shifted/out/clocks.json").read_bytes()
    # .82 and .63 mm: a drift of 100 ppm that nobody announced is .3 ms off at either end.
    assert rms_m(tmp_path / "shifted", 0.0) < 1.4 * rms_m(tmp_path / "aligned", 0.0)
