"""Markers that one camera, or none, has seen for long, while it sees the others of the same hand.

Fingers hide markers for a second or two, and an empty desk has none: a marker counts as missing
only while most of the other markers of its hand are seen, and in one camera only while that camera
sees some of them well inside its picture. What stays missing nearly always has a range that no
longer fits its paint. A camera that sees next to nothing of a hand, most of which another one sees,
is told as a whole: the hand may be outside its view.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import HANDS, HandName
from services.fusion.arrays import Bools, Ints
from services.fusion.intake.observations import Landmark, View

# Long enough that a fist, a turned hand or a cup in it is over, short enough that a person who
# looks whether it works is told within ten seconds.
UNSEEN_S = 6.0
# Of a camera's frames of a second: fewer and a marker is not seen (a wrong range still catches a
# frame now and then), more and it is. In between nothing changes.
_UNSEEN_SHARE, _SEEN_SHARE = 0.1, 0.3
# A camera with fewer frames in a second says nothing about what is not in them.
_MIN_FRAMES = 5
# A look after a longer pause than this tells nothing about the time between.
_LONGEST_S = 2.0
# Without its hand for so long a marker is no longer spoken of: nobody wants faults of an empty
# desk. Long enough to put the hand down and type the command that mends it.
_FORGET_S = 60.0


@dataclass(frozen=True)
class UnseenMarker:
    """One landmark that cameras do not see (by name), though most others of its hand are seen."""

    landmark: int
    unseen_by: tuple[str, ...]
    seen_by: tuple[str, ...]  # the cameras that do see it
    seconds: float  # of those the longest, with the hand in view
    ever_seen: bool  # by one of unseen_by, since the start


@dataclass(frozen=True)
class UnseenHand:
    """A hand of which cameras see next to nothing, though others see most of it."""

    hand: HandName
    unseen_by: tuple[str, ...]
    seen_by: tuple[str, ...]
    seconds: float


class UnseenMarkerMonitor:
    """How long each of L landmarks has not been seen by each of C cameras; hands share none."""

    def __init__(self, cameras: tuple[Camera, ...], landmarks: tuple[Landmark, ...]) -> None:
        shape = (len(cameras), len(landmarks))
        self._names = [camera.name for camera in cameras]
        self._edges = [_edges(camera) for camera in cameras]  # least and greatest ray (2, 2)
        hands = np.array([landmark.hand for landmark in landmarks], dtype=str)
        self._hands = {hand: np.flatnonzero(hands == hand) for hand in HANDS if hand in hands}
        self._latest: list[View | None] = [None] * len(cameras)
        # Since the last look: frames by camera, and in how many of them each landmark was. Lists,
        # as they are counted up with every frame.
        self._frames = [0] * len(cameras)
        self._counts = [[0] * len(landmarks) for _ in cameras]
        self._unseen_s = np.zeros(shape)
        self._ever_seen = np.zeros(shape, dtype=bool)
        self._handless_s = np.zeros(len(landmarks))
        self._hand_unseen_s = {hand: np.zeros(len(cameras)) for hand in self._hands}

    def observe(self, view: View) -> None:
        """Count a frame's markers."""
        self._latest[view.camera] = view
        self._frames[view.camera] += 1
        counts = self._counts[view.camera]
        for landmark in view.landmarks.tolist():
            counts[landmark] += 1

    def look(self, elapsed_s: float) -> tuple[list[UnseenMarker], list[UnseenHand]]:
        """What is missing, as of the frames since the last look, elapsed_s ago (about a second)."""
        elapsed_s = min(elapsed_s, _LONGEST_S)
        frames = np.array(self._frames, dtype=float)  # (C,)
        share = np.array(self._counts) / np.maximum(frames, 1.0)[:, None]  # (C, L)
        delivers = frames >= _MIN_FRAMES
        share[~delivers] = 0.0
        self._frames = [0] * len(frames)
        self._counts = [[0] * share.shape[1] for _ in frames]
        self._ever_seen |= share >= _SEEN_SHARE
        self._unseen_s[share >= _SEEN_SHARE] = 0.0
        hands = []
        for hand, rows in self._hands.items():
            seen = share[:, rows] >= 0.5  # (C, n)
            self._count_markers(rows, seen, share, delivers, elapsed_s)
            hands += self._unseen_hand(hand, seen, delivers, elapsed_s)
        self._unseen_s[:, self._handless_s > _FORGET_S] = 0.0
        rows_all = range(share.shape[1])
        return [found for row in rows_all if (found := self._unseen(row, delivers))], hands

    def _unseen_hand(
        self, hand: HandName, seen: Bools, delivers: Bools, elapsed_s: float
    ) -> list[UnseenHand]:
        """Add the time to the cameras that see next to nothing of a hand: one at most is found."""
        number = np.count_nonzero(seen, axis=1)  # (C,) of n markers
        most = 2 * number > seen.shape[1]
        unseen_s = self._hand_unseen_s[hand]
        unseen_s[~delivers | (3 * number >= seen.shape[1]) | ~most.any()] = 0.0
        unseen_s[delivers & (3 * number < seen.shape[1]) & most.any()] += elapsed_s
        long = unseen_s >= UNSEEN_S
        if not long.any():
            return []
        seconds = float(unseen_s[long].max())
        return [UnseenHand(hand, self._named(long), self._named(most), seconds)]

    def _count_markers(
        self, rows: Ints, seen: Bools, share: Array, delivers: Bools, elapsed_s: float
    ) -> None:
        """Add the time to what is missing of one hand, whose landmarks are rows (n,)."""
        whole = np.array([d and self._inside(c, rows) for c, d in enumerate(delivers)])  # (C,)
        for n, row in enumerate(rows.tolist()):
            others = np.delete(seen, n, axis=1)
            wanted = others.shape[1]
            if wanted == 0 or 2 * np.count_nonzero(others.any(axis=0)) <= wanted:
                self._handless_s[row] += elapsed_s
                continue
            self._handless_s[row] = 0.0
            # A third of the others: one stray blob in an empty picture is no hand.
            in_view = whole & (3 * np.count_nonzero(others, axis=1) >= wanted)
            self._unseen_s[in_view & (share[:, row] < _UNSEEN_SHARE), row] += elapsed_s

    def _inside(self, camera: int, rows: Ints) -> bool:
        """Whether a hand, as far as a camera saw it last, is well inside the camera's picture.

        A marker that is missing lies about the others: half their extent beyond, it would still be
        in the picture.
        """
        view = self._latest[camera]
        if view is None:
            return False
        rays = view.rays[np.isin(view.landmarks, rows)]  # (m, 2)
        if not len(rays):
            return False
        least, greatest = rays.min(axis=0), rays.max(axis=0)
        beyond = 0.5 * (greatest - least).max()
        low, high = self._edges[camera]
        return bool(np.all(least - beyond >= low) and np.all(greatest + beyond <= high))

    def _unseen(self, row: int, delivers: Bools) -> UnseenMarker | None:
        unseen = delivers & (self._unseen_s[:, row] >= UNSEEN_S)
        if not unseen.any():
            return None
        seen = delivers & ~unseen & self._ever_seen[:, row] & (self._unseen_s[:, row] == 0.0)
        return UnseenMarker(
            landmark=row,
            unseen_by=self._named(unseen),
            seen_by=self._named(seen),
            seconds=float(self._unseen_s[unseen, row].max()),
            ever_seen=bool(self._ever_seen[unseen, row].any()),
        )

    def _named(self, cameras: Bools) -> tuple[str, ...]:
        return tuple(name for name, chosen in zip(self._names, cameras, strict=True) if chosen)


def _edges(camera: Camera) -> Array:
    """The least and the greatest ray (2, 2) of a camera's picture, from the middles of its sides.

    (Corners are further out with barrel distortion, and may be beyond the lens model's range.)
    """
    width, height = camera.size_px
    sides = np.array(
        [
            (0.0, height / 2),
            (width - 1.0, height / 2),
            (width / 2, 0.0),
            (width / 2, height - 1.0),
        ]
    )
    rays = camera.rays_from_pixels(sides)
    low, high = np.array([(rays[0, 0], rays[2, 1]), (rays[1, 0], rays[3, 1])])
    # A side beyond the lens model's range (NaN) is no limit.
    return np.array([np.nan_to_num(low, nan=-np.inf), np.nan_to_num(high, nan=np.inf)])


def unseen_text(found: UnseenMarker, name: str) -> str:
    """What is wrong in one sentence; name is what people call the marker."""
    lasting = f"for {math.floor(found.seconds)} s"
    seen = "not seen" if found.ever_seen else "never seen"
    text = f"{name}: {seen} by {_listed(found.unseen_by)} {lasting}"
    return f"{text}; {_listed(found.seen_by)} {_see(found.seen_by)} it" if found.seen_by else text


def unseen_hand_text(found: UnseenHand) -> str:
    """What is wrong in one sentence."""
    return (
        f"the {found.hand} hand: next to none of its markers are seen by"
        f" {_listed(found.unseen_by)} for {math.floor(found.seconds)} s;"
        f" {_listed(found.seen_by)} {_see(found.seen_by)} most of them"
    )


def unseen_action(cameras: tuple[str, ...]) -> str:
    """What to do about markers that these cameras do not see."""
    commands = _listed([f"`rhot calibrate colors {camera}`" for camera in cameras])
    return f"if it is in view and lit, the range no longer fits: {commands}"


def _see(cameras: tuple[str, ...]) -> str:
    return "sees" if len(cameras) == 1 else "see"


def _listed(names: tuple[str, ...] | list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
