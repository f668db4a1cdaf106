"""A phalanx' skin is found where it was, from a pose that is off."""

from __future__ import annotations

import numpy as np
import pytest

from studies.grasp.measure.edges.finder import EdgeFinder
from studies.grasp.measure.edges.skin.patches import placed


@pytest.fixture(scope="module")
def followed(plain):
    """Shape, windows, poses (8, 6) and kept skin of a rendered finger."""
    _, frames, seeds = plain
    finder = EdgeFinder("index", seeds)
    for frame in frames:
        finder.look(frame)
    follower, kept = finder._follower, [one.kept for one in finder._followed]
    poses = np.stack([one.vector for one in finder._followed])
    return follower.shape, follower.windows, poses, kept


def test_a_picture_that_is_off_is_found_where_the_others_say(followed):
    shape, windows, poses, kept = followed
    found = placed(kept, windows, (shape, poses), (shape, poses))
    turn = poses[4, 3]
    step = 2.5 * np.array([np.cos(turn), np.sin(turn)])
    moved = poses.copy()
    moved[4, :2] += step
    again = placed(kept, windows, (shape, poses), (shape, moved))
    # The proximal phalanx, along its bone; the other pictures hardly notice.
    offset = (again.poses - found.poses)[:, 1, :2] @ step / 2.5
    assert abs(offset[4]) < 0.7
    assert np.abs(np.delete(offset, 4)).max() < 0.7
    assert (again.weights[:, 1] > 0.4).all()


def test_a_shade_that_slides_does_not_move_fine_skin(followed):
    """As flesh folds beside a joint, light moves along the bone, and the skin does not."""
    shape, windows, poses, kept = followed
    rows, columns = np.mgrid[: kept[0][1].shape[0], : kept[0][1].shape[1]]
    shaded = []
    for number, one in enumerate(kept):
        x, y = columns - 40.0 - 4.0 * number, rows - 0.3 * len(rows)
        shade = 40.0 * np.exp(-0.5 * np.square(np.hypot(x, y) / 10.0))
        shaded.append((one[0], (one[1] + shade).astype(np.float16), *one[2:]))

    def moved(fine_px):
        still, slid = (
            placed(pictures, windows, (shape, poses), (shape, poses), fine_px).poses[:, 1, :2]
            for pictures in (kept, shaded)
        )
        return float(np.hypot(*(slid - still).T).max())

    assert moved(2.0) < 0.2 < 0.5 < moved(None)


def test_skin_seen_in_one_picture_tells_nothing(followed):
    shape, windows, poses, kept = followed
    alone = placed(kept[:1], windows, (shape, poses[:1]), (shape, poses[:1]))
    assert not alone.weights.any()
    assert np.isfinite(alone.poses).all()
