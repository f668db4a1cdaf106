"""Bundle adjustment: lenses, camera places and board poses that explain all corners best. Pure.

Levenberg-Marquardt on the normal equations (Triggs et al., "Bundle Adjustment - A Modern
Synthesis", 1999), corner by corner weighted by soft_l1, rho(s) = 2 (sqrt(1 + s) - 1). Boards are
eliminated from the equations, which leaves 15 unknowns per camera; the same function calibrates one
lens, a rig, or only a board's pose. Rotations are updated by small rotations from the left, exp(w)
R, so there is no singular angle. A problem that leaves something undetermined still returns, with a
large sigma; nothing here refuses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector, transform
from services.calibrator.bundle.lens_model import LENS_SIZE
from services.calibrator.bundle.residuals import (
    CAMERA_SIZE,
    POSE_SIZE,
    Corners,
    State,
    View,
    corner_derivatives,
    corner_errors,
    rms,
    stacked,
)

# A corner this many pixels off begins to lose weight. Corners of sharp pictures are off by .1-.3
# px.
_SOFT_PX = 1.0
_MAX_STEPS = 60
# Relative change of the cost that ends the search: with 3000 corners the unknowns are then within
# .02 of their sigma.
_STOP = 1e-7


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The state found, one error (n, 2) px for each view, one sigma for each lens number (c, 9) and
    place (c, 6); 0 where held.

    Places' sigmas are of the small rotation (rad) and the translation (m) of T_camera_from_rig.
    """

    state: State
    errors: tuple[Array, ...]
    lens_sigma: Array
    place_sigma: Array
    steps: int

    @property
    def rms_px(self) -> float:
        """Root of the mean squared distance between a corner and its projection."""
        return rms(np.concatenate(self.errors)) if self.errors else 0.0


@dataclass(frozen=True, eq=False)
class Free:
    """What may move: lens (c, 9) bool, place (c,) bool, boards all or none."""

    lens: np.ndarray
    place: np.ndarray
    boards: bool = True


def adjust(
    views: list[View],
    start: State,
    free: Free,
    *,
    soft_px: float = _SOFT_PX,
    max_steps: int = _MAX_STEPS,
) -> Adjusted:
    """Adjust what is free to the views, from a start close enough that boards are in front of their
    cameras.
    """
    corners, chosen = stacked(views), _free_unknowns(free)
    state, damping, steps = start, 1e-3, 0
    equations = _equations(corners, state, soft_px)
    while steps < max_steps and np.isfinite(equations.cost) and (len(chosen) or free.boards):
        steps += 1
        proposal = _moved(state, *equations.step(chosen, free.boards, damping))
        cost = _cost(corners, proposal, soft_px)
        if not cost < equations.cost:
            damping *= 8.0
            # No step is small enough to gain anything: this is the bottom.
            if damping > 1e9:
                break
            continue
        gain = equations.cost - cost
        state, damping = proposal, max(damping / 6.0, 1e-12)
        equations = _equations(corners, state, soft_px)
        if gain <= _STOP * cost + 1e-15:
            break
    return _result(corners, state, equations, chosen, free.boards, steps)


def _free_unknowns(free: Free) -> np.ndarray:
    """Numbers of the camera unknowns that may move."""
    return np.flatnonzero(
        np.concatenate([free.lens, np.repeat(free.place[:, None], POSE_SIZE, axis=1)], axis=1)
    )


def _cost(corners: Corners, state: State, soft_px: float) -> float:
    error = corner_errors(corners, state)
    squared = np.sum(error * error, axis=1) / soft_px**2
    return soft_px**2 * _soft(squared) if np.all(np.isfinite(squared)) else float("inf")


def _soft(squared: Array) -> float:
    """The sum of soft_l1 over squared errors in units of its scale."""
    return float(np.sum(2.0 * (np.sqrt(1.0 + squared) - 1.0)))


@dataclass(frozen=True, eq=False)
class _Equations:
    """The cost and its Gauss-Newton equations, cameras (m unknowns) and boards (b of six) apart,
    over all unknowns, free or not.
    """

    cost: float
    cameras: Array  # (m, m)
    boards: Array  # (b, 6, 6)
    mixed: Array  # (b, m, 6)
    camera_slope: Array  # (m,)
    board_slope: Array  # (b, 6)

    def step(self, chosen: np.ndarray, boards: bool, damping: float) -> tuple[Array, Array]:
        """The damped step of the cameras (m,) and boards (b, 6); 0 where held.

        Marquardt's scaling: the diagonal is raised by a share of itself, so that units do not
        matter. Boards are eliminated first (Schur complement), since none of them meets another in
        any picture.
        """
        camera_step, board_step = np.zeros(len(self.cameras)), np.zeros_like(self.board_slope)
        V = self.boards + damping * self.boards * np.eye(POSE_SIZE) + 1e-12 * np.eye(POSE_SIZE)
        if len(chosen):
            A = self.cameras[np.ix_(chosen, chosen)]
            A = A + damping * np.diag(np.diag(A))
            slope = self.camera_slope[chosen]
            if boards:
                W = self.mixed[:, chosen]
                through = np.linalg.solve(V, W.transpose(0, 2, 1))  # (b, 6, c)
                A = A - np.einsum("bck,bkd->cd", W, through)
                slope = slope - np.einsum("bkc,bk->c", through, self.board_slope)
            scale = 1.0 / np.sqrt(np.maximum(np.diag(A), 1e-30))
            camera_step[chosen] = (
                np.linalg.solve(A * scale[:, None] * scale + 1e-13 * np.eye(len(A)), slope * scale)
                * scale
            )
        if boards:
            right = self.board_slope - np.einsum("bmk,m->bk", self.mixed, camera_step)
            board_step = np.linalg.solve(V, right[..., None])[..., 0]
        return camera_step, board_step

    def camera_variance(self, chosen: np.ndarray, boards: bool) -> Array:
        """Variance (m,) of each camera unknown for errors of one px, all others unknown.

        0 where held.
        """
        variance = np.zeros(len(self.cameras))
        if not len(chosen) or not np.isfinite(self.cost):
            variance[chosen] = np.inf
            return variance
        A = self.cameras[np.ix_(chosen, chosen)]
        if boards:
            W = self.mixed[:, chosen]
            A = A - np.einsum(
                "bck,bkd->cd",
                W,
                np.linalg.solve(self.boards + 1e-12 * np.eye(POSE_SIZE), W.transpose(0, 2, 1)),
            )
        scale = 1.0 / np.sqrt(np.maximum(np.diag(A), 1e-30))
        inverse = np.linalg.pinv(A * scale[:, None] * scale, rcond=1e-14, hermitian=True)
        variance[chosen] = np.maximum(np.diag(inverse), 0.0) * scale**2
        return variance


def _equations(corners: Corners, state: State, soft_px: float) -> _Equations:
    m, count = len(state.lenses) * CAMERA_SIZE, len(state.T_rig_from_board)
    cameras, boards, mixed = (
        np.zeros((m, m)),
        np.zeros((count, POSE_SIZE, POSE_SIZE)),
        np.zeros((count, m, POSE_SIZE)),
    )
    camera_slope, board_slope = np.zeros(m), np.zeros((count, POSE_SIZE))
    error, J = corner_derivatives(corners, state)
    squared = np.sum(error * error, axis=1) / soft_px**2
    weighted = J / np.sqrt(1.0 + squared)[:, None, None]
    begin = 0
    for end in corners.ends:
        J_view, weighted_view = (
            J[begin:end].reshape(-1, CAMERA_SIZE + POSE_SIZE),
            weighted[begin:end].reshape(-1, CAMERA_SIZE + POSE_SIZE),
        )
        H, g = weighted_view.T @ J_view, weighted_view.T @ error[begin:end].reshape(-1)
        board, here = (
            corners.board[begin],
            slice(corners.camera[begin] * CAMERA_SIZE, (corners.camera[begin] + 1) * CAMERA_SIZE),
        )
        cameras[here, here] += H[:CAMERA_SIZE, :CAMERA_SIZE]
        boards[board] += H[CAMERA_SIZE:, CAMERA_SIZE:]
        mixed[board, here] += H[:CAMERA_SIZE, CAMERA_SIZE:]
        camera_slope[here] += g[:CAMERA_SIZE]
        board_slope[board] += g[CAMERA_SIZE:]
        begin = end
    return _Equations(
        soft_px**2 * _soft(squared), cameras, boards, mixed, camera_slope, board_slope
    )


def _moved(state: State, camera_step: Array, board_step: Array) -> State:
    by_camera = camera_step.reshape(len(state.lenses), CAMERA_SIZE)
    places = np.stack(
        [
            _turned(T, move)
            for T, move in zip(state.T_camera_from_rig, by_camera[:, LENS_SIZE:], strict=True)
        ]
    )
    boards = np.stack(
        [_turned(T, move) for T, move in zip(state.T_rig_from_board, board_step, strict=True)]
    )
    return replace(
        state,
        lenses=state.lenses + by_camera[:, :LENS_SIZE],
        T_camera_from_rig=places,
        T_rig_from_board=boards,
    )


def _turned(T: Array, move: Array) -> Array:
    return (
        transform(rotation_from_vector(move[:3]) @ T[:3, :3], T[:3, 3] + move[3:])
        if np.any(move)
        else T
    )


def _result(
    corners: Corners,
    state: State,
    equations: _Equations,
    chosen: np.ndarray,
    boards: bool,
    steps: int,
) -> Adjusted:
    error = corner_errors(corners, state)
    unknowns = len(chosen) + (POSE_SIZE * len(state.T_rig_from_board) if boards else 0)
    variance = float(np.sum(error * error)) / max(1, error.size - unknowns)
    sigma = np.sqrt(variance * equations.camera_variance(chosen, boards)).reshape(
        len(state.lenses), CAMERA_SIZE
    )
    return Adjusted(
        state,
        tuple(np.split(error, corners.ends[:-1])),
        sigma[:, :LENS_SIZE],
        sigma[:, LENS_SIZE:],
        steps,
    )
