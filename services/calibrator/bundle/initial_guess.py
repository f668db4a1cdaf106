"""First guesses that the adjustment can improve: a lens from nothing, a board's pose, where one
camera stands to another. Pure.

Guesses are scored by reprojection and taken by the median over all pictures, so that single bad
pictures do not mislead them. Too few pictures, or a pair of cameras that no guess fits, is for the
caller to refuse: the score comes along.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from rhot.geometry.transforms import Array, inverse, transform
from services.calibrator.bundle.adjust import Adjusted, Free, adjust
from services.calibrator.bundle.lens_model import CX, CY, FX, FY, K1, K2, project, rays
from services.calibrator.bundle.residuals import State, View, rms

# Focal lengths tried, in picture widths: fields of view of 127 to 14 degrees, 20 % apart.
_FOCALS = 0.25 * 1.2 ** np.arange(16)
# Views that vote on where a camera stands; each votes with every numbering of its board.
_VOTERS = 30


def lens_guess(size_px: tuple[int, int], views: list[View]) -> Array:
    """A lens (9,) without distortion, centred: the focal length with which the boards' views fit
    best.

    Scored by the median view: a strongly distorting lens bends some views more than a wrong focal
    length does.
    """
    scores = []
    for factor in _FOCALS:
        lens = centred(size_px, factor * size_px[0])
        scores.append(float(np.median([board_pose(lens, view)[1] for view in views])))
    return centred(size_px, _FOCALS[int(np.argmin(scores))] * size_px[0])


def centred(size_px: tuple[int, int], focal_px: float) -> Array:
    """An ideal lens (9,) looking through the middle of the picture."""
    return np.array(
        [
            focal_px,
            focal_px,
            (size_px[0] - 1) / 2.0,
            (size_px[1] - 1) / 2.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        ]
    )


def board_pose(lens: Array, view: View) -> tuple[Array, float]:
    """T_camera_from_board (4, 4) of one view, and its reprojection RMS in px (inf where no pose
    fits).

    Collins & Bartoli, "Infinitesimal Plane-Based Pose Estimation" (2014), the better of its two
    poses.
    """
    seen = rays(lens, view.pixels)
    scale = float(np.ptp(view.points, axis=0).max())
    # Far ahead: wrong, but in front of the camera, so that an adjustment can begin.
    best, least = transform(np.eye(3), [0.0, 0.0, 5.0 * scale]), float("inf")
    if not np.all(np.isfinite(seen)):
        return best, least
    # Scaled to about 1 so that millimetre boards and metre boards are solved alike.
    points = np.ascontiguousarray(view.points / scale).reshape(-1, 1, 3)
    try:
        count, vectors, shifts, _ = cv2.solvePnPGeneric(
            points, seen.reshape(-1, 1, 2), np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
        )
    except cv2.error:
        return best, least
    for vector, shift in zip(vectors[:count], shifts[:count], strict=True):
        T = transform(
            cv2.Rodrigues(vector)[0].astype(np.float64), scale * np.asarray(shift).reshape(3)
        )
        error = rms(view.pixels - project(lens, view.points @ T[:3, :3].T + T[:3, 3]))
        if error < least:
            best, least = T, error
    return best, least


def calibrate_lens(
    size_px: tuple[int, int], views: list[View], free: np.ndarray, guess: Array | None = None
) -> Adjusted:
    """One camera's lens from its views (their boards numbered 0..n-1): guess, then adjust in
    stages.

    free (9,) says which lens numbers may move. Stages, because the distortion must not explain a
    focal length that is far off.
    """
    lens = lens_guess(size_px, views) if guess is None else guess
    stages = (
        [free]
        if guess is not None
        else [
            _only(free, (FX, FY)),
            _only(free, (FX, FY, K1)),
            _only(free, (FX, FY, CX, CY, K1, K2)),
            free,
        ]
    )
    result = None
    for stage in stages:
        result = with_poses(lens, views, stage)
        lens = result.state.lenses[0]
    # A pose of the wrong branch (a near-frontal board turned the other way) is found again with the
    # lens now known.
    again = with_poses(lens, views, free)
    return again if result is None or again.rms_px <= result.rms_px else result


def with_poses(lens: Array, views: list[View], free: np.ndarray) -> Adjusted:
    """Adjust one lens (9,) and the boards' poses, beginning with poses from the lens."""
    poses = np.stack([board_pose(lens, view)[0] for view in views])
    state = State(lens[None].copy(), np.eye(4)[None], poses)
    return adjust(views, state, Free(free[None], np.array([False])))


def _only(free: np.ndarray, names: tuple[int, ...]) -> np.ndarray:
    mask = np.zeros_like(free)
    mask[list(names)] = True
    return mask & free


@dataclass(frozen=True, eq=False)
class Relation:
    """T_second_from_first (4, 4), and by view pair: the turn of the second view's numbering that
    fits, and its error in px.
    """

    T_second_from_first: Array
    turns: tuple[int, ...]
    errors_px: tuple[float, ...]

    @property
    def median_px(self) -> float:
        """How well the median pair of views fits."""
        return float(np.median(self.errors_px))


def relate(
    lenses: tuple[Array, Array], pairs: list[tuple[View, View]], turned: list[np.ndarray]
) -> Relation:
    """Where the second camera stands to the first: the guess of one pair of views that fits the
    median pair best.

    turned are the renumberings under which a view may be meant (ordering.turns; one identity for
    boards whose numbering is certain): view.pixels[turn] belong to view.points.
    """
    first = [board_pose(lenses[0], view)[0] for view, _ in pairs]
    options = [
        [replace(b, pixels=b.pixels[turn]) if len(turned) > 1 else b for turn in turned]
        for _, b in pairs
    ]
    second = [[board_pose(lenses[1], option)[0] for option in several] for several in options]
    best: Relation | None = None
    # Voters spread over all pairs: neighbours in a series look alike.
    for k in np.unique(np.linspace(0, len(pairs) - 1, min(_VOTERS, len(pairs))).astype(np.int64)):
        for T_second in second[k]:
            T = T_second @ inverse(first[k])
            found = _fit(lenses[1], T, first, options)
            if best is None or found.median_px < best.median_px:
                best = found
    if best is None:
        return Relation(np.eye(4), (), (float("inf"),))
    return best


def _fit(lens: Array, T: Array, first: list[Array], options: list[list[View]]) -> Relation:
    turns, errors = [], []
    for T_board, several in zip(first, options, strict=True):
        T_view = T @ T_board
        misses = []
        for view in several:
            error = rms(view.pixels - project(lens, view.points @ T_view[:3, :3].T + T_view[:3, 3]))
            misses.append(error if np.isfinite(error) else float("inf"))
        turns.append(int(np.argmin(misses)))
        errors.append(min(misses))
    return Relation(T, tuple(turns), tuple(errors))
