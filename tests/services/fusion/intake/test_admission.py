"""Which frames belong to the present."""

from __future__ import annotations

from services.fusion.intake.admission import WINDOW_NS, FrameAdmission, Verdict

FRAME_NS = 33_333_333
T0_NS = 1_700_000_000_000_000_000


def running(cameras: int = 2) -> FrameAdmission:
    admission = FrameAdmission(cameras)
    assert admission.admit(0, T0_NS) is Verdict.RESTART
    for camera in range(1, cameras):
        assert admission.admit(camera, T0_NS + 1000 * camera) is Verdict.ACCEPT
    return admission


def test_frames_in_a_row_and_a_little_out_of_order_are_accepted():
    admission = running()
    for k in (1, 2, 4, 3, 5):
        assert admission.admit(0, T0_NS + k * FRAME_NS) is Verdict.ACCEPT


def test_the_same_frame_twice_counts_once():
    admission = running()
    assert admission.admit(0, T0_NS + FRAME_NS) is Verdict.ACCEPT
    assert admission.admit(0, T0_NS + FRAME_NS) is Verdict.TWICE
    assert admission.admit(1, T0_NS + FRAME_NS) is Verdict.ACCEPT


def test_one_clock_that_jumps_is_ignored_while_the_other_goes_on():
    admission = running()
    for jump_ns in (10**9, -(10**9)):
        for k in range(1, 40):
            now_ns = T0_NS + abs(jump_ns) + k * FRAME_NS if jump_ns < 0 else T0_NS + k * FRAME_NS
            assert admission.admit(1, now_ns) in (Verdict.ACCEPT, Verdict.RESTART)
            assert admission.admit(0, now_ns + jump_ns) is Verdict.ASTRAY
        assert admission.admit(0, now_ns + 5) is Verdict.ACCEPT


def test_after_a_pause_of_all_two_cameras_agree_at_once():
    admission = running()
    later_ns = T0_NS + 5 * 10**9
    assert admission.admit(0, later_ns) is Verdict.ASTRAY
    assert admission.admit(1, later_ns + FRAME_NS // 2) is Verdict.RESTART
    assert admission.admit(0, later_ns + FRAME_NS) is Verdict.ACCEPT


def test_a_single_camera_insists():
    admission = running()
    verdicts = [admission.admit(0, T0_NS - 10**12 + k * FRAME_NS) for k in range(4)]
    assert verdicts == [Verdict.ASTRAY, Verdict.ASTRAY, Verdict.RESTART, Verdict.ACCEPT]


def test_strays_that_do_not_agree_with_themselves_never_move_time():
    admission = running()
    for k in range(1, 100):
        assert admission.admit(0, T0_NS + k * 10 * WINDOW_NS * (-1) ** k) is Verdict.ASTRAY
    assert admission.newest_ns == T0_NS + 1000


def test_a_first_frame_from_another_year_is_outvoted():
    admission = FrameAdmission(2)
    assert admission.admit(0, 4_000_000_000_000_000_000) is Verdict.RESTART
    assert admission.admit(0, T0_NS) is Verdict.ASTRAY
    assert admission.admit(1, T0_NS + 7) is Verdict.RESTART
