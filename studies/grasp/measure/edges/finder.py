"""A plain finger's joints by its outline and its skin. Pure; pictures come in their order.

In the first one a person says where the joints are; the silhouette learned there (learn.py) is
followed through the pictures (follow.py), and when all were seen, they are adjusted together
(adjust.py).
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import bgr_image
from studies.grasp.measure.edges.adjust import Adjusted, Clicks, adjust
from studies.grasp.measure.edges.contrast import colours_of
from studies.grasp.measure.edges.follow import Followed, Follower
from studies.grasp.measure.edges.learn import Learnt, learn, learn_base, widths_beside
from studies.grasp.measure.edges.outline import Link, frame_of
from studies.grasp.measure.edges.segments import Array, edges_near
from studies.grasp.measure.edges.silhouette import POSE, Silhouette, joints_at
from studies.grasp.measure.edges.skin.patches import placed
from studies.grasp.measure.edges.tip import round_end, tip_of
from studies.grasp.measure.joints import B1, B2, Finger, Place, Seen, joints_of
from studies.grasp.measure.seeds import Seeds

# Beside a phalanx, outlines are looked for up to this share of its length, when they are learned.
_LEARN_REACH = 0.8
# The back of the hand: its outline may be further from the base line than this link is long.
_WIDEST_BASE = 1.5
# A phalanx of which less than this of both sides is supported by edges was not measured; from
# _WELL on it is as well seen as it gets (one side is folded away where a finger is bent).
_LEAST_SUPPORT, _WELL = 0.15, 0.5
# The mean of all pictures' skin is as sharp as their poses are right, so it is made several times:
# first of all light, which is found from further off, then of what is finer than so many px. Of
# light DIP's centre comes out up to 1.6 px towards the palm, whatever was clicked. PIP and DIP from
# the truth on (subjects 1, 3, 5 and three people more), deg RMS: 1.3 and 2.2 by all light, 1.1 and
# 1.9, .6 and 1.0, .5 and .7, .5 and .7 by what is finer than 6, 3, 2, 1.5 px. Without the first
# round one of twelve was lost. Where the outline was followed 5 deg off, PIP's error is 5.7, 4.7,
# 2.9, 1.3, 1.1, 1.1 deg from round to round; elsewhere the fourth changes .05 deg.
_SKIN_ROUNDS = (None, 2.0, 2.0, 2.0, 2.0, 2.0)


class _Instant(NamedTuple):
    """What a picture is told by."""

    frame: int
    time_s: float
    size_px: tuple[int, int]


class EdgeFinder:
    """One finger."""

    def __init__(self, finger: Finger, seeds: Seeds) -> None:
        self._names = list(joints_of(finger).values())
        self._base_names = [f"{finger}_{B1}", f"{finger}_{B2}"]
        joints = np.array([seeds[name] for name in self._names])  # (4, 2)
        has_base = set(self._base_names) <= set(seeds)
        base = np.array([seeds[name] for name in self._base_names]) if has_base else None
        self._clicks = Clicks(joints, base)
        self._follower: Follower | None = None
        self._followed: list[Followed] = []
        self._instants: list[_Instant] = []
        self._tip_note = ""

    def look(self, frame: Frame) -> None:
        """The next picture. Raises CaptureError of seeds that are not on a finger in the first."""
        image = bgr_image(frame)
        if self._follower is None:
            self._follower = Follower(self._learnt(image), base=self._clicks.base is not None)
        self._followed.append(self._follower.follow(image))
        self._instants.append(_Instant(frame.seq, 1e-9 * frame.stamp_ns, frame.size_px))

    def seen(self) -> list[Seen]:
        """The joints of all pictures, and why others are missing."""
        if self._follower is None:
            return []
        found = self._adjusted(self._follower)
        return [self._told(found, number) for number in range(len(self._instants))]

    def _adjusted(self, follower: Follower) -> Adjusted:
        """All pictures together: by the outline first, then by where each phalanx' skin is."""
        found = adjust(follower.shape, self._followed, self._clicks)
        kept = [one.kept for one in self._followed]
        then = follower.shape, np.stack([one.vector for one in self._followed])
        for fine_px in _SKIN_ROUNDS:
            skin = placed(kept, follower.windows, then, (found.shape, found.poses), fine_px)
            found = adjust(follower.shape, self._followed, self._clicks, skin, found)
        return self._ended(follower, then, found)

    def _ended(
        self, follower: Follower, then: tuple[Silhouette, Array], found: Adjusted
    ) -> Adjusted:
        """The last bone from the DIP joint to the tip that the click means (tip.py)."""
        kept = [one.tip for one in self._followed]
        end = round_end(kept, follower.tip_window, then, (found.shape, found.poses))
        _, _, dip, _ = joints_at(found.poses[0], found.shape.lengths)
        turn = found.poses[0, 5]
        along = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        (x, y), self._tip_note = tip_of(along @ (self._clicks.joints[3] - dip), end)
        # The outline is not laid into a picture again.
        shape = found.shape.changed(
            found.shape.distances,
            np.append(found.shape.lengths[:2], np.hypot(x, y)),
            found.shape.flesh,
        )
        poses = found.poses + np.append(np.zeros(POSE - 1), np.arctan2(y, x))
        return found._replace(shape=shape, poses=poses)

    def _learnt(self, image: np.ndarray) -> Learnt:
        grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        joints = self._clicks.joints
        reach = _LEARN_REACH * float(np.median(np.hypot(*np.diff(joints, axis=0).T)))
        edges = edges_near(grey, joints, reach)
        widths = widths_beside(edges, joints, self._names)
        base = None if self._clicks.base is None else self._base(grey, joints, self._clicks.base)
        return learn(colours_of(image), edges, joints, widths, base)

    def _base(self, grey: np.ndarray, joints: Array, clicked: Array) -> tuple[Array, Link]:
        """Where the back of the hand begins, and its outline up to the MCP joint."""
        b1, b2 = clicked
        u, _, length = frame_of(b1, b2)
        # A link that ends at the MCP joint, parallel to the base line, as far back as B1.
        start = joints[0] - u * max(float((joints[0] - b1) @ u), length)
        edges = edges_near(grey, np.array([b1, b2]), _WIDEST_BASE * length)
        steps = joints[[1, 3]] - joints[[0, 2]]
        bend = steps[0, 0] * steps[1, 1] - steps[0, 1] * steps[1, 0]
        link = learn_base(edges, start, joints[0], _WIDEST_BASE, 1 if bend >= 0.0 else -1)
        if link is None:
            raise CaptureError(
                f"seeds {' and '.join(self._base_names)}: no outline of the hand runs along the "
                "line between them; put them on the back of the hand, or give --base x1,y1,x2,y2"
            )
        return start, link

    def _told(self, found: Adjusted, number: int) -> Seen:
        """One picture's places with their sigmas."""
        instant, pose = self._instants[number], found.poses[number]
        joints = joints_at(pose, found.shape.lengths)
        support = found.support[number].mean(axis=1)
        places: dict[str, Place] = {}
        lost: dict[str, str] = {}
        for joint, name in enumerate(self._names):
            beside = [phalanx for phalanx in (joint, joint + 1) if 1 <= phalanx <= 3]
            share = float(support[beside].min())
            x, y = joints[joint].tolist()
            if not (0 <= x < instant.size_px[0] and 0 <= y < instant.size_px[1]):
                lost[name] = "out of view"
            elif share < _LEAST_SUPPORT:
                lost[name] = f"its outline is hidden ({100 * share:.0f} % seen)"
            else:
                sigma = _sigma(found, number, joint)
                places[name] = Place(x, y, sigma, min(1.0, share / _WELL))
        if self._clicks.base is not None:
            places |= self._base_places(found, number, self._clicks.base)
        notes = ((self._names[-1], self._tip_note),) if number == 0 else ()
        return Seen(instant.frame, instant.time_s, places, lost, notes)

    def _base_places(self, found: Adjusted, number: int, base: Array) -> dict[str, Place]:
        """B1 and B2, which move with the back of the hand."""
        first, now = found.poses[0], found.poses[number]
        offsets = base - first[:2]
        along = offsets @ np.array([np.cos(first[2]), np.sin(first[2])])
        across = float((offsets @ np.array([-np.sin(first[2]), np.cos(first[2])])).mean())
        across = 0.0 if self._clicks.through else across
        c, s = np.cos(now[2]), np.sin(now[2])
        sigma = _sigma(found, number, 0)
        return {
            name: Place(
                float(now[0] + at * c - across * s), float(now[1] + at * s + across * c), sigma
            )
            for name, at in zip(self._base_names, along, strict=True)
        }


def _sigma(found: Adjusted, picture: int, joint: int) -> float:
    """Of a joint's coordinates, px: the covariance of the pose, carried to it."""
    by_pose = np.zeros((2, found.poses.shape[1]))
    by_pose[:, :2] = np.eye(2)
    for bone in range(joint):
        turn = found.poses[picture, 3 + bone]
        by_pose[:, 3 + bone] = found.shape.lengths[bone] * np.array([-np.sin(turn), np.cos(turn)])
    covariance = by_pose @ found.covariances[picture] @ by_pose.T
    return float(np.sqrt(0.5 * np.trace(covariance)))
