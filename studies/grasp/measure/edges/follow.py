"""A silhouette followed from picture to picture: predicted by its motion and its skin, corrected by
its outline. Pure.

What is found in each picture is kept for a second look with all pictures (adjust.py): the pose, the
move that the skin showed, and the edges along each normal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from services.pi_tracker.image.frame import Image
from studies.grasp.measure.edges.contrast import (
    Picture,
    colours_of,
    edges_along,
    inside_colours,
    profiles,
    tukey,
)
from studies.grasp.measure.edges.fit import within_limits
from studies.grasp.measure.edges.learn import Learnt
from studies.grasp.measure.edges.segments import Array
from studies.grasp.measure.edges.silhouette import POSE, joints_at, lay, normals_of, shown
from studies.grasp.measure.edges.skin.patches import Kept, kept_of, windows_of
from studies.grasp.measure.edges.skin.texture import (
    Moved,
    Pyramid,
    moved,
    pyramid_of,
    remembered,
    skin_of,
)
from studies.grasp.measure.edges.tip import Kept as TipKept
from studies.grasp.measure.edges.tip import tip_kept, tip_window

# A motion goes on as it was, less a little: fingers that stop are as many as those that go on.
_MOMENTUM = 0.8
# From so fast a turn on, rad a picture, it may also have stopped.
_SWIFT_RAD = np.radians(2.0)
# Where a segment's skin fits worse than usual by this factor, the last two phalanges are looked for
# turned, too, which has to fit better by as much. A tip that jumped to the next finger's (DIP 18
# deg off for 15 pictures; subject 2) misfits by 8 to 10 levels, there by 0.9; usual is 0.5 to 1.3,
# learned by this share a picture from so many levels on.
_LOST, _LEARN_MISFIT, _FIRST_MISFIT = 2.5, 0.1, 1.0
_TURNS = np.radians(
    [
        [0.0, 0.0, 0.0, 0.0, middle, middle + distal]
        for middle in (-8.0, 0.0, 8.0)
        for distal in (-20.0, -10.0, 0.0, 10.0, 20.0)
        if middle or distal
    ]
)
# Edges are looked for so far from a predicted outline, px, and fitted within limits that narrow.
_REACH_PX, _LIMITS_PX = 7.0, (6.0, 5.0, 4.0, 4.0, 3.0, 3.0)
# An edge's standard deviation about the outline, and so many samples err together.
EDGE_SIGMA_PX, _TOGETHER = 1.0, 3.0
EDGE_INFORMATION = 1.0 / (_TOGETHER * EDGE_SIGMA_PX**2)
# The palm's side and the tip are not measured yet: they count this much.
_UNKNOWN_COUNTS = 0.3
# A finger may be so far from where it was.
_FURTHER_PX = 20.0
# What skin shows of a move is this sure at best, px and rad: it slides and bulges on the bones.
_SKIN_SIGMA = np.array([1.0, 1.0, *np.radians((1.0, 1.0, 1.0, 1.0))])
# Neighbouring points of skin err together.
_SKIN_COUNTS = 0.1
# The colour inside of the outline is learned on by this share a picture: light changes as a finger
# turns.
_LEARN_COLOUR = 0.3


class Followed(NamedTuple):
    """One picture: pose (6,); the skin's move since the last one (6,), None in the first; edges
    (n, MOST, 2) px and their weights (n, MOST); the skin's misfit, levels; each segment's skin;
    the edges about the tip.
    """

    vector: Array
    move: Array | None
    edges: Array
    weights: Array
    misfit: float
    kept: Kept
    tip: TipKept


class Follower:
    """One finger, from the first picture on."""

    def __init__(self, learnt: Learnt, *, base: bool) -> None:
        """base: whether the back of the hand was learned; else its direction is held."""
        self.shape = learnt.shape
        self._normals = normals_of(learnt.shape)
        self._skin = skin_of(learnt.shape)
        self.windows = windows_of(learnt.shape)
        self.tip_window = tip_window(learnt.shape)
        self._vector = learnt.vector.copy()
        self._velocity = np.zeros(POSE)
        self._memory: list[Array] | None = None
        self._inside: Picture | None = None
        self._misfit = _FIRST_MISFIT
        self._base = base
        samples = learnt.shape.samples
        known = (samples.side == -learnt.shape.palm) | (samples.segment == 0)
        self._counts = np.where(known, 1.0, _UNKNOWN_COUNTS)

    def follow(self, image: Image) -> Followed:
        """The next picture (h, w, 3)."""
        part, corner = self._near(image)
        self._vector[:2] -= corner
        kept = self._followed(colours_of(part))
        self._vector[:2] += corner
        return kept._replace(vector=self._vector.copy(), edges=kept.edges + corner)

    def _near(self, image: Image) -> tuple[Image, Array]:
        """The part of a picture where the finger may be, and its upper left corner (2,)."""
        height, width = image.shape[:2]
        joints = joints_at(self._vector, self.shape.lengths)
        back = joints[0] - self.shape.base * np.array(
            [np.cos(self._vector[2]), np.sin(self._vector[2])]
        )
        points = np.concatenate([joints, back[None]])
        margin = 2.0 * self.shape.distances.max() + _FURTHER_PX
        low = np.clip(np.floor(points.min(axis=0) - margin), 0, (width - 16, height - 16))
        high = np.clip(np.ceil(points.max(axis=0) + margin), low + 16, (width, height))
        (x0, y0), (x1, y1) = low.astype(int), high.astype(int)
        return np.ascontiguousarray(image[y0:y1, x0:x1]), low

    def _followed(self, colours: Picture) -> Followed:
        pyramid = pyramid_of(colours)
        vector, move, misfit = self._vector, None, 0.0
        if self._memory is not None:
            skin = self._by_skin(pyramid, self._memory)
            move, misfit = skin.vector - vector, skin.misfit
            vector = self._by_outline(colours, skin)
            self._velocity, self._vector = vector - self._vector, vector
        self._memory = remembered(pyramid, self._skin, self.shape, vector)
        return self._kept(colours, move, misfit)

    def _by_skin(self, pyramid: Pyramid, memory: list[Array]) -> Moved:
        """From where the motion goes on; from where it stopped, if that fits better; if neither
        fits, from where the last two phalanges may have turned to.
        """
        starts = [self._vector + _MOMENTUM * self._velocity]
        if np.abs(self._velocity[2:]).max() >= _SWIFT_RAD:
            starts.append(self._vector)
        found = [moved(pyramid, memory, self._skin, self.shape, start) for start in starts]
        best = min(found, key=_misfit)
        if best.misfit > _LOST * self._misfit:
            turned = [starts[0] + turn for turn in _TURNS]
            found = [moved(pyramid, memory, self._skin, self.shape, one) for one in turned]
            other = min(found, key=_misfit)
            # A finger that is not seen at all fits nowhere.
            best = other if _LOST * other.misfit <= best.misfit else best
        else:
            self._misfit += _LEARN_MISFIT * (best.misfit - self._misfit)
        return best

    def _by_outline(self, colours: Picture, skin: Moved) -> Array:
        """The pose at which the outline lies on edges, held where the skin says."""
        sure = _SKIN_COUNTS * skin.information + 1e-6 * np.eye(POSE)
        held = np.linalg.inv(np.linalg.inv(sure) + np.diag(_SKIN_SIGMA**2))
        if not self._base:
            held[2, 2] += 1e8
        vector = skin.vector.copy()
        for limit in _LIMITS_PX:
            laid = lay(self.shape, self._normals, vector)
            seen = profiles(colours, laid.points, laid.normals, _REACH_PX)
            found = edges_along(seen, self._inside)
            weights = found.weights * tukey(found.offsets, limit)
            weights *= (EDGE_INFORMATION * self._counts * shown(self.shape, vector))[:, None]
            total, pull = weights.sum(axis=1), (weights * found.offsets).sum(axis=1)
            normal = laid.by_pose.T @ (total[:, None] * laid.by_pose) + held
            right = laid.by_pose.T @ pull + held @ (skin.vector - vector)
            vector = vector + np.linalg.solve(normal, right)
            vector[2:] = within_limits(vector[2:], self.shape.palm)
        return vector

    def _kept(self, colours: Picture, move: Array | None, misfit: float) -> Followed:
        laid = lay(self.shape, self._normals, self._vector)
        seen = profiles(colours, laid.points, laid.normals, _REACH_PX)
        found = edges_along(seen, self._inside)
        inside = inside_colours(seen)
        if self._inside is None:
            self._inside = inside
        self._inside = self._inside + np.float32(_LEARN_COLOUR) * (inside - self._inside)
        places = laid.points[:, None] + found.offsets[..., None] * laid.normals[:, None]
        skin = kept_of(colours, self.windows, self.shape, self._vector)
        tip = tip_kept(colours, self.tip_window, self.shape, self._vector)
        return Followed(self._vector.copy(), move, places, found.weights, misfit, skin, tip)


def _misfit(found: Moved) -> float:
    return found.misfit
