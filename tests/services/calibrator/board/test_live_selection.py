"""Live collecting: still and new positions are kept, and the person is told what to do."""

from __future__ import annotations

from dataclasses import replace

import pytest

from services.calibrator.board.live_selection import LiveSelection, Verdict


@pytest.fixture
def seen(make_bench):
    """A selection for two cameras, and what they see position by position."""
    bench = make_bench(positions=10)
    found = bench.detections(0.05)
    both = [key for key in bench.poses if key in found["left"] and key in found["right"]]
    return LiveSelection(["left", "right"], bench.board, 3), [
        {camera: found[camera][key] for camera in found} for key in both
    ]


def test_a_position_is_kept_once_it_stands_still(seen):
    selection, positions = seen
    assert selection.offer(positions[0]).verdict is Verdict.MOVING
    assert selection.offer(positions[0]).verdict is Verdict.KEPT
    assert selection.offer(positions[0]).verdict is Verdict.KNOWN
    assert len(selection.kept) == 1


def test_a_board_that_moves_is_not_kept(seen):
    selection, positions = seen
    selection.offer(positions[0])
    moved = {
        camera: replace(shown, corners=shown.corners + 2.0)
        for camera, shown in positions[0].items()
    }
    result = selection.offer(moved)
    assert result.verdict is Verdict.MOVING
    assert result.cameras == ("left", "right")


def test_a_camera_that_does_not_see_the_board_is_named_and_breaks_the_stillness(seen):
    selection, positions = seen
    selection.offer(positions[0])
    result = selection.offer({**positions[0], "right": None})
    assert (result.verdict, result.cameras) == (Verdict.UNSEEN, ("right",))
    assert selection.offer(positions[0]).verdict is Verdict.MOVING
    assert "right" in selection.text(result)


def test_enough_positions_are_enough(seen):
    selection, positions = seen
    for position in positions[:3]:
        assert not selection.done
        selection.offer(position)
        assert selection.offer(position).verdict is Verdict.KEPT
    assert selection.done
    text = selection.text()
    assert text.startswith("3/3 positions; covered left ")
    assert "right" in text


def test_the_first_line_needs_no_position(seen):
    selection, _ = seen
    assert selection.text() == "0/3 positions"
