"""Frames of a video that show the picture before them once more.

A converter that makes a constant rate of a camera's own (a phone's, a webcam's in dim light), or a
recorder that lost a picture, fills up with the one before. To a tracker that is a hand which stands
still for a frame and then leaps, in one camera and not in the other: markers of a slow hand were 24
mm off where 7 are usual. Encoded anew such a picture is not the same to the bit. What tells is how
it changes where a video changes most, at the hand's edges, against the changes before and after.

* It changes much less than both: a frame of a moving hand, for .1 s at the most. Longer, a hand may
  rest in a video without noise. Where one turns round it does not move from frame to frame either,
  but then it comes back to where it was.
* It changes hardly anywhere, where those before it did by their noise: for however long.

Live cameras are watched for pictures that are the same to the bit (pi_tracker's monitors).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import cv2
import numpy as np

from services.pi_tracker.image.frame import Frame, Image

# Of pictures twice as wide and more not every pixel is looked at. They are compared by the means of
# this many blocks a row, 8 px wide at 640; and changes are means over so many that change most,
# what a few edges of a hand cover.
_PIXELS, _BLOCKS, _MOST_CHANGED = 640, 80, 20
# A duplicate changes by less than this of what its neighbours do. (Of three simulated scenes, sharp
# and blurred, and a webcam's video of a ball, with 12 % duplicates through x264 at crf 18 to 28,
# VP9, MPEG-4 and JPEG: 92 % are found; with .45 more, and 2 of the 1004 pictures of the webcam's
# own, where the ball is slow for a frame.)
_SHARE = 0.3
# Less is no change, in grey levels: of a hand that rests nothing can be told, nor needs to be.
# (This one and those of time and noise below were set by what these clips show, not swept.)
_LEAST = 2.0
# The picture after must be as far from the one before as this share of the two steps between them;
# a block that changes by more than so many medians is more than noise. (Of the same and a recorded
# hand that waves none of 17,500 other pictures is taken for one; with .7 of the larger step instead
# three of the latter's 120, where it turns round.)
_ON, _NOISE = 0.6, 2.0
# A hand may rest in a video without noise, but not for so short a time.
_LONGEST_NS = 100_000_000
# Noise stops: half the blocks change by less than this share of what they did in each of so many
# pictures (some encoders refresh one of twelve), which was so many grey levels. And what is less
# than so many is no noise of a picture's own.
_NOISE_SHARE, _NOISE_FRAMES, _LEAST_NOISE, _SOME_NOISE = 0.2, 15, 0.5, 0.25


class _Change(NamedTuple):
    """From one picture to another, in grey levels of its blocks."""

    most: float  # where it is largest
    median: float  # of half the picture
    moved: float  # sum of what is more than noise: grows with the way that things went

    def stands_still(self, other: _Change) -> bool:
        """Whether it is that of a duplicate next to another: it has no noise of its own either."""
        own_noise = self.median > max(0.5 * other.median, _SOME_NOISE)
        return self.most < _SHARE * other.most and not own_noise


_NO_CHANGE = _Change(0.0, 0.0, 0.0)


class DuplicateFrames:
    """Leaves them out of one camera's frames, and counts them."""

    def __init__(self) -> None:
        self.count = self._frames = 0
        # The last two pictures that are none, and the change between them.
        self._before: Image | None = None
        self._last: Image | None = None
        self._change = _NO_CHANGE
        # Half the blocks' change of the latest that are none.
        self._medians: deque[float] = deque(maxlen=_NOISE_FRAMES)
        # Frames after the last that may be duplicates: the next one tells.
        self._waiting: list[tuple[Frame, _Change]] = []
        self._last_ns = 0

    def new_frames(self, frames: Iterable[Frame]) -> Iterator[Frame]:
        """The frames that are none, in order; one that may be one comes after the next is read."""
        for frame in frames:
            self._frames += 1
            yield from self._next(frame)
        yield from self._take_waiting()

    def text(self, camera: str) -> str:
        """What a user should know of a camera's frames, "" if none was left out."""
        if not self.count:
            return ""
        were = "was" if self.count == 1 else "were"
        return (
            f"camera {camera!r}: {self.count} of {self._frames} pictures {were} the one before "
            "once more and left out; a video at the rate of its camera has none"
        )

    def _next(self, frame: Frame) -> Iterator[Frame]:
        image = _luma(frame)
        change = self._from_last(image)
        if self._change.most > _LEAST and change.stands_still(self._change):
            if self._without_noise(change):
                self.count += 1
                return
            self._waiting.append((frame, change))
            if frame.stamp_ns - self._last_ns > _LONGEST_NS:
                yield from self._take_waiting()
            return
        if self._waiting:
            if self._goes_on(image, change):
                self.count += len(self._waiting)
                self._waiting.clear()
            else:
                yield from self._take_waiting()
                change = self._from_last(image)
        yield self._take(frame, image, change)

    def _from_last(self, image: Image) -> _Change:
        return _NO_CHANGE if self._last is None else _change(self._last, image)

    def _without_noise(self, change: _Change) -> bool:
        """Whether a picture lacks the noise that the ones before it had."""
        usual = min(self._medians) if len(self._medians) == _NOISE_FRAMES else 0.0
        return usual > _LEAST_NOISE and change.median < _NOISE_SHARE * usual

    def _goes_on(self, image: Image, change: _Change) -> bool:
        """Whether a picture continues a motion that the waiting ones interrupt."""
        if self._before is None:
            return False
        far = _change(self._before, image)
        way = self._change.moved + change.moved
        stand = all(waiting.stands_still(change) for _, waiting in self._waiting)
        return stand and far.moved > _ON * way

    def _take_waiting(self) -> Iterator[Frame]:
        """Those waiting are none."""
        for frame, _ in self._waiting:
            image = _luma(frame)
            yield self._take(frame, image, self._from_last(image))
        self._waiting.clear()

    def _take(self, frame: Frame, image: Image, change: _Change) -> Frame:
        """Remember a frame that is none, and the change from the last to it."""
        if self._last is not None:
            self._medians.append(change.median)
        self._before, self._last, self._change = self._last, image, change
        self._last_ns = frame.stamp_ns
        return frame


def _luma(frame: Frame) -> Image:
    """The brightness of a frame's picture (h, w), of a large one of every so many-th pixel."""
    width, height = frame.size_px
    step = max(width // _PIXELS, 1)
    whole = frame.image[:height] if frame.layout == "i420" else frame.image[:, :, 1]
    # A copy: what is kept of a picture must not keep all of it.
    return np.ascontiguousarray(whole[::step, ::step])


def _change(one: Image, other: Image) -> _Change:
    if one.shape != other.shape:
        return _Change(255.0, 255.0, 255.0 * _BLOCKS**2)
    height = max(round(_BLOCKS * one.shape[0] / one.shape[1]), 1)
    difference = cv2.absdiff(one, other).astype(np.float32)
    blocks = cv2.resize(difference, (_BLOCKS, height), interpolation=cv2.INTER_AREA).ravel()
    top = np.partition(blocks, -_MOST_CHANGED)[-_MOST_CHANGED:]
    median = float(np.median(blocks))
    moved = float(np.maximum(blocks - _NOISE * median, 0.0).sum())
    return _Change(float(top.mean()), median, moved)
