"""Live collecting: still and new positions are kept, and the person is told what to do."""

from __future__ import annotations

from dataclasses import replace

import pytest

from services.calibrator.board.live_selection import Collector, Verdict


@pytest.fixture
def seen(make_bench):
    """A collector for two cameras, and what they see position by position."""
    bench = make_bench(positions=10)
    found = bench.detections(0.05)
    both = [key for key in bench.poses if key in found["left"] and key in found["right"]]
    return Collector(["left", "right"], bench.board, 3), [
        {camera: found[camera][key] for camera in found} for key in both
    ]


def test_a_position_is_kept_once_it_stands_still(seen):
    collector, positions = seen
    assert collector.offer(positions[0]).verdict is Verdict.MOVING
    assert collector.offer(positions[0]).verdict is Verdict.KEPT
    assert collector.offer(positions[0]).verdict is Verdict.KNOWN
    assert len(collector.kept) == 1


def test_a_board_that_moves_is_not_kept(seen):
    collector, positions = seen
    collector.offer(positions[0])
    moved = {
        camera: replace(shown, corners=shown.corners + 2.0)
        for camera, shown in positions[0].items()
    }
    take = collector.offer(moved)
    assert take.verdict is Verdict.MOVING
    assert take.cameras == ("left", "right")


def test_a_camera_that_does_not_see_the_board_is_named_and_breaks_the_stillness(seen):
    collector, positions = seen
    collector.offer(positions[0])
    take = collector.offer({**positions[0], "right": None})
    assert (take.verdict, take.cameras) == (Verdict.UNSEEN, ("right",))
    assert collector.offer(positions[0]).verdict is Verdict.MOVING
    assert "right" in collector.text(take)


def test_enough_positions_are_enough(seen):
    collector, positions = seen
    for position in positions[:3]:
        assert not collector.done
        collector.offer(position)
        assert collector.offer(position).verdict is Verdict.KEPT
    assert collector.done
    text = collector.text()
    assert text.startswith("3/3 positions; covered left ")
    assert "right" in text


def test_the_first_line_needs_no_position(seen):
    collector, _ = seen
    assert collector.text() == "0/3 positions"
