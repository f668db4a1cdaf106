"""Fusion's faults begin within seconds, name what to do, and end when it is over."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import pytest

from rhot.files.config import RigConfig
from rhot.messages import MarkerFrame
from rhot.process.fault_log import FaultLog
from services.fusion.faults import FusionFaults
from services.fusion.step import FusionStep
from testing.synthetic_points import START_NS, MovingHand, SyntheticRig, frames, point_hands

RIG = SyntheticRig(clock_error_s=0.0, clock_sigma_s=1e-4, loss=0.0)
replace = msgspec.structs.replace
Change = Callable[[MarkerFrame, float], MarkerFrame | None]


class Run:
    """A synthetic hand through fusion, with a look at the faults after each second."""

    def __init__(self, config: RigConfig | None = None) -> None:
        config = config or RIG.config()
        self.log = FaultLog(lambda: 0)
        self.step = FusionStep(config, RIG.rig(), point_hands())
        self.faults = FusionFaults(self.step, config, self.log, 0.0)

    def play(self, seconds: int, change: Change, *, running: bool = True) -> list[set[str]]:
        """The codes that stand after each second."""
        given = frames(RIG, MovingHand(), seconds)
        found, second = [], 1
        for frame in given:
            at_s = (frame.stamp_ns - frame.clock_offset_ns - START_NS) * 1e-9
            while at_s >= second:
                found.append(self.look(second, running=running))
                second += 1
            changed = change(frame, at_s)
            if changed is not None:
                self.step.step(changed)
        return [*found, self.look(second, running=running)]

    def look(self, now_s: float, *, running: bool = True) -> set[str]:
        self.faults.look(now_s, session_running=running)
        return {fault.code for fault in self.log.standing()}

    @property
    def only(self):
        (fault,) = self.log.standing()
        return fault


def of_right(change: Callable[[MarkerFrame], MarkerFrame | None], from_s=0.0, to_s=99.0) -> Change:
    return lambda frame, at_s: (
        change(frame) if frame.camera == "right" and from_s <= at_s < to_s else frame
    )


def lost(_: MarkerFrame) -> None:
    """The frame never arrives."""


def moved(frame: MarkerFrame, **by: float) -> MarkerFrame:
    return replace(
        frame,
        markers=[
            replace(m, **{name: getattr(m, name) + value for name, value in by.items()})
            for m in frame.markers
        ],
    )


def test_all_is_well_where_nothing_is_wrong():
    assert Run().play(14, lambda frame, _: frame) == [set()] * 14


@pytest.mark.parametrize(
    ("change", "code", "words"),
    [
        (
            lambda frame: replace(frame, size_px=(1280, 960)),
            "camera_wrong_size",
            ["another size", "`rhot calibrate lens right`"],
        ),
        (
            lambda frame: replace(frame, stamp_ns=frame.stamp_ns + 10**9),
            "camera_clock_off",
            ["camera right", "far off"],
        ),
        (lambda frame: replace(frame, camera="door"), "camera_unknown", ["door", "[[camera]]"]),
        (lambda frame: moved(frame, y_px=8.0), "camera_moved", ["left and right", "stereo"]),
        (
            lambda frame: replace(
                frame, markers=[replace(m, x_px=639.0 - m.x_px) for m in frame.markers]
            ),
            "cameras_mirrored",
            ["left and right", "horizontally", "hflip"],
        ),
    ],
    ids=["size", "clock", "stranger", "moved", "mirrored"],
)
def test_a_camera_that_is_wrong_is_named_until_it_is_right(change, code, words):
    run = Run()
    found = run.play(22, of_right(change, 2.0, 9.0))
    assert code not in found[1]
    assert any(code in standing for standing in found[2:9])
    # What was named while it was wrong says what and what to do.
    again = Run()
    again.play(8, of_right(change, 2.0))
    fault = next(fault for fault in again.log.standing() if fault.code == code)
    assert all(word in fault.text + fault.action for word in words), fault
    assert found[-1] == set()


def test_a_clock_that_is_off_is_put_right_and_named_until_it_is_right():
    def late(frame: MarkerFrame) -> MarkerFrame:
        return replace(frame, stamp_ns=frame.stamp_ns + 700_000_000)

    run = Run()
    run.play(8, of_right(late))
    assert run.only.code == "camera_clock_aligned"
    assert run.only.subject == "right"
    assert "the stamps of camera right are 700 ms late" in run.only.text
    assert "claim 0.1 ms" in run.only.text
    found = Run().play(20, of_right(late, 0.0, 9.0))
    assert "camera_clock_aligned" in found[8]
    assert found[-1] == set()


def test_a_camera_that_falls_silent_is_named_with_its_host():
    config = RIG.config()
    cameras = [replace(c, host=f"pi-{c.name}") for c in config.camera]
    run = Run(replace(config, camera=cameras))
    # Services start one after the other: the first ten seconds are nobody's fault.
    found = run.play(16, of_right(lost, 11.0, 15.0))
    assert "camera_silent" not in set().union(*found[:13])
    assert "camera_silent" in found[14]
    assert "camera_silent" not in found[15]
    assert run.look(30.0) == set(), "a process that stood still has heard nobody"
    for now_s in (31.0, 32.0, 33.0):
        run.look(now_s)
    faults = run.log.standing()
    assert {fault.subject for fault in faults} == {"left", "right"}
    assert "pi-right" in faults[1].text
    assert "rhot-pi-tracker@right" in faults[1].action
    assert run.look(34.0, running=False) == set()


def test_a_camera_that_sends_the_same_frame_for_ever_is_silent_and_measures_nothing():
    run, first = Run(), []

    def frozen(frame: MarkerFrame) -> MarkerFrame:
        # Its clock's estimate goes on, and so does its number.
        first.append(frame)
        return replace(
            first[0], seq=frame.seq, clock_offset_ns=frame.clock_offset_ns + 1000 * len(first)
        )

    found = run.play(16, of_right(frozen, 11.0))
    assert found[-1] == {"camera_silent"}
    assert "the same frame again and again" in run.only.text
    assert run.step.refusals["twice"] > 100


def without(*colors: str) -> Callable[[MarkerFrame], MarkerFrame]:
    return lambda frame: replace(frame, markers=[m for m in frame.markers if m.color not in colors])


def test_a_marker_that_is_lost_is_named_until_it_is_seen():
    run = Run()
    found = run.play(20, lambda frame, at_s: without("lime")(frame) if 2 < at_s < 15 else frame)
    begun = next(n for n, codes in enumerate(found, start=1) if codes)
    assert 2 + 6 <= begun <= 2 + 9
    assert found[-1] == set()
    again = Run()
    again.play(14, lambda frame, at_s: without("lime")(frame) if at_s > 2 else frame)
    assert again.only.code == "marker_not_seen"
    assert again.only.subject == "lime"
    assert "lime (little tip): not seen by left and right for 1" in again.only.text
    assert "`rhot calibrate colors left` and `rhot calibrate colors right`" in again.only.action


def test_a_marker_of_one_camera_says_who_sees_it():
    run = Run()
    run.play(12, of_right(without("lime")))
    assert run.only.text.startswith("lime (little tip): never seen by right for ")
    assert run.only.text.endswith("; left sees it")
    assert run.only.action.endswith("the range no longer fits: `rhot calibrate colors right`")


def at_right_edge(*colors: str) -> Callable[[MarkerFrame], MarkerFrame]:
    """An area of 80 px has a radius of 5."""
    return lambda frame: replace(
        frame,
        markers=[replace(m, x_px=637.0) if m.color in colors else m for m in frame.markers],
    )


def test_a_marker_that_the_edge_cuts_for_long_is_named_until_it_is_whole():
    run = Run()
    cut = of_right(at_right_edge("lime", "violet"), 2.0, 12.0)
    begun = next(n for n, codes in enumerate(run.play(20, cut), 1) if "marker_at_edge" in codes)
    assert 2 + 6 <= begun <= 2 + 8
    assert "marker_at_edge" not in run.look(21)
    again = Run()
    again.play(11, of_right(at_right_edge("lime", "violet")))
    (fault,) = (one for one in again.log.standing() if one.code == "marker_at_edge")
    assert (fault.severity, fault.subject) == ("warning", "right")
    assert "right's picture has cut violet (wrist), lime (little tip) for" in fault.text


def test_a_hand_that_passes_the_edge_is_nobodys_concern():
    run = Run()

    def now_and_then(frame: MarkerFrame, at_s: float) -> MarkerFrame:
        return at_right_edge("lime")(frame) if at_s % 4.0 < 1.5 else frame

    assert not any("marker_at_edge" in codes for codes in run.play(16, now_and_then))
