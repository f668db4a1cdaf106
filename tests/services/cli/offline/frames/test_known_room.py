"""What a recording's tracker knows before its first picture."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.files.rig_tables import Tracker
from services.cli.offline.frames import known_room
from services.cli.offline.frames.known_room import with_known_room
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.step import TrackerStep
from testing.synthetic_images import PAINTS, Tip, clean, frame_of, noisy, ranges

COLORS = ("green", "blue", "magenta", "cyan")
SIZE_PX = (320, 240)
PERIOD_NS = 33_333_333


def picture(number, path_px):
    """Tips that a path leads before things of their paints, which are larger."""
    tips = [
        Tip(color, 40.0 + 40.0 * n + path_px, 120.0, width_px=13.0, length_px=15.0)
        for n, color in enumerate(COLORS)
    ]
    image, truth = clean(tips, SIZE_PX)
    for n, color in enumerate(COLORS):
        image[30:52, 60 + 40 * n : 80 + 40 * n] = PAINTS[color]
    frame = frame_of(noisy(image, 3.0, number), number)
    return Frame(
        "left", number, 10**9 + number * PERIOD_NS, 0.0, SIZE_PX, frame.image, frame.layout
    ), truth


@pytest.fixture(scope="module")
def film():
    """A hand at rest for half a second, which then goes to and fro."""
    paths = [0.0] * 15 + [25.0 * np.sin(0.25 * n) for n in range(60)]
    return [picture(number, path) for number, path in enumerate(paths)]


def tracker(**settings):
    return TrackerStep("left", ranges(), Tracker(**settings), SIZE_PX, COLORS)


def found(frames, truths, step):
    """The share of tips that are told where they are."""
    hits = 0
    for frame, truth in zip(frames, truths, strict=True):
        for marker in step.step(frame).markers:
            hits += np.hypot(*(np.array(truth[marker.color]) - (marker.x_px, marker.y_px))) < 6.0
    return hits / (len(truths) * len(COLORS))


def test_things_that_stand_still_are_known_at_the_first_picture(film):
    frames, truths = [frame for frame, _ in film], [truth for _, truth in film]
    at_once = tracker()
    alone = found(frames[:15], truths[:15], at_once)
    prepared = tracker()
    assert list(with_known_room(frames, prepared)) == frames
    assert found(frames[:15], truths[:15], prepared) > max(0.98, alone)
    assert alone < 0.5


def test_it_comes_to_the_first_picture_backwards_and_from_before(film, monkeypatch):
    step, seen = tracker(), []
    monkeypatch.setattr(step, "step", lambda frame: seen.append((frame.seq, frame.stamp_ns)))
    frames = [frame for frame, _ in film]
    list(with_known_room(frames, step))
    assert [seq for seq, _ in seen] == list(range(len(frames) - 1, 0, -1))
    assert np.all(np.diff([stamp_ns for _, stamp_ns in seen]) == PERIOD_NS)
    assert seen[-1][1] == frames[0].stamp_ns - PERIOD_NS


def test_large_and_long_recordings_have_their_beginning_only(film, monkeypatch):
    frames = [frame for frame, _ in film]
    for name, value, count in (
        ("_MOST_BYTES", 10 * frames[0].image.nbytes, 9),
        ("_SECONDS", 1.0, 31),
    ):
        monkeypatch.setattr(known_room, name, value)
        step, seen = tracker(), []
        monkeypatch.setattr(step, "step", seen.append)
        assert list(with_known_room(iter(frames), step)) == frames
        assert len(seen) == count
        monkeypatch.undo()


def test_a_tracker_that_learns_nothing_sees_nothing_before(film):
    frames = [frame for frame, _ in film]
    step = tracker(method="paper")
    assert not step.learns_room
    assert list(with_known_room(frames, step)) == frames
    assert list(with_known_room([], tracker())) == []
