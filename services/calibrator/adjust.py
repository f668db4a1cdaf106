"""Bundle adjustment: lenses, camera places and board poses that explain all corners best. Pure.

Levenberg-Marquardt on the normal equations (Triggs et al., "Bundle Adjustment - A Modern Synthesis", 1999), corner by corner
weighted by soft_l1, rho(s) = 2 (sqrt(1 + s) - 1). The unknowns are few (15 per camera, 6 per board position), so the equations are
dense and solved directly; the same function calibrates one lens, a rig, or only a board's pose. Rotations are updated by small
rotations from the left, exp(w) R, so there is no singular angle. A problem that leaves something undetermined still returns,
with a large sigma; nothing here refuses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rhot.transforms import Array, rotation_from_vector, transform
from services.calibrator.model import LENS_SIZE, project, project_with_derivatives

# Unknowns of a camera: nine of its lens, six of its place; of a board: six.
_CAMERA, _POSE = LENS_SIZE + 6, 6
# A corner this many pixels off begins to lose weight. Corners of sharp pictures are off by .1-.3 px.
_SOFT_PX = 1.0
_MAX_STEPS = 60
# Relative change of the cost that ends the search: a millionth of it moves no parameter by a hundredth of its sigma.
_STOP = 1e-9


@dataclass(frozen=True, eq=False)
class View:
    """The corners of one board position in one camera's picture: numbers ids (n,), points (n, 3) of the board, pixels (n, 2)."""

    camera: int
    board: int
    ids: np.ndarray
    points: Array
    pixels: Array


@dataclass(frozen=True, eq=False)
class State:
    """Lens vectors (c, 9), camera places T_camera_from_rig (c, 4, 4), board poses T_rig_from_board (b, 4, 4)."""

    lenses: Array
    T_camera_from_rig: Array
    T_rig_from_board: Array


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The state found, one error (n, 2) px for each view, one sigma for each lens number (c, 9) and place (c, 6); 0 where held.

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


def rms(errors: Array) -> float:
    """Root mean square length of errors (n, 2 or 3); 0 of none."""
    return float(np.sqrt(np.mean(np.sum(errors * errors, axis=-1)))) if len(errors) else 0.0


def adjust(views: list[View], start: State, free: Free, *, soft_px: float = _SOFT_PX, max_steps: int = _MAX_STEPS) -> Adjusted:
    """Adjust what is free to the views, from a start close enough that boards are in front of their cameras."""
    corners, chosen = _stacked(views), _free_unknowns(start, free)
    state, damping, steps = start, 1e-3, 0
    cost, H, g = _equations(corners, state, soft_px)
    while steps < max_steps and len(chosen):
        steps += 1
        proposal = _moved(state, _solve(H, g, chosen, damping))
        new_cost = _cost(corners, proposal, soft_px)
        if not new_cost < cost:
            damping *= 8.0
            # No step is small enough to gain anything: this is the bottom.
            if damping > 1e9:
                break
            continue
        gain = cost - new_cost
        state, damping = proposal, max(damping / 6.0, 1e-12)
        cost, H, g = _equations(corners, state, soft_px)
        if gain <= _STOP * cost + 1e-15:
            break
    return _result(views, state, H, chosen, steps)


def pixel_errors(views: list[View], state: State) -> tuple[Array, ...]:
    """Measured minus projected pixels (n, 2) of each view; NaN behind the camera."""
    corners = _stacked(views)
    return tuple(np.split(_errors(corners, state), corners.ends[:-1]))


@dataclass(frozen=True, eq=False)
class _Corners:
    """The corners of all views in one array each; view k ends before ends[k]."""

    points: Array  # (n, 3)
    pixels: Array  # (n, 2)
    camera: np.ndarray  # (n,)
    board: np.ndarray  # (n,)
    ends: np.ndarray  # (v,)


def _stacked(views: list[View]) -> _Corners:
    counts = [len(view.points) for view in views]
    return _Corners(
        np.concatenate([view.points for view in views]),
        np.concatenate([view.pixels for view in views]),
        np.repeat([view.camera for view in views], counts),
        np.repeat([view.board for view in views], counts),
        np.cumsum(counts),
    )


def _errors(corners: _Corners, state: State) -> Array:
    T = state.T_camera_from_rig[corners.camera] @ state.T_rig_from_board[corners.board]
    p_camera = np.einsum("nij,nj->ni", T[:, :3, :3], corners.points) + T[:, :3, 3]
    return corners.pixels - project(state.lenses[corners.camera], p_camera)


def _free_unknowns(state: State, free: Free) -> np.ndarray:
    cameras = np.concatenate([free.lens, np.repeat(free.place[:, None], _POSE, axis=1)], axis=1)
    boards = np.full(len(state.T_rig_from_board) * _POSE, free.boards)
    return np.flatnonzero(np.concatenate([cameras.reshape(-1), boards]))


def _cost(corners: _Corners, state: State, soft_px: float) -> float:
    error = _errors(corners, state)
    squared = np.sum(error * error, axis=1) / soft_px**2
    return soft_px**2 * _soft(squared) if np.all(np.isfinite(squared)) else float("inf")


def _soft(squared: Array) -> float:
    """The sum of soft_l1 over squared errors in units of its scale."""
    return float(np.sum(2.0 * (np.sqrt(1.0 + squared) - 1.0)))


def _equations(corners: _Corners, state: State, soft_px: float) -> tuple[float, Array, Array]:
    """The cost, its Gauss-Newton matrix (m, m) and downhill gradient (m,) over all unknowns, free or not."""
    cameras = len(state.lenses)
    m = cameras * _CAMERA + len(state.T_rig_from_board) * _POSE
    H, g = np.zeros((m, m)), np.zeros(m)
    error, J = _derivatives(corners, state)
    squared = np.sum(error * error, axis=1) / soft_px**2
    weighted = J / np.sqrt(1.0 + squared)[:, None, None]
    begin = 0
    for end in corners.ends:
        J_view, weighted_view = J[begin:end].reshape(-1, _CAMERA + _POSE), weighted[begin:end].reshape(-1, _CAMERA + _POSE)
        camera, board = corners.camera[begin] * _CAMERA, cameras * _CAMERA + corners.board[begin] * _POSE
        where = np.concatenate([np.arange(camera, camera + _CAMERA), np.arange(board, board + _POSE)])
        H[np.ix_(where, where)] += weighted_view.T @ J_view
        g[where] += weighted_view.T @ error[begin:end].reshape(-1)
        begin = end
    return soft_px**2 * _soft(squared), H, g


def derivatives(views: list[View], state: State) -> tuple[Array, Array]:
    """Errors (n, 2) of all corners, and the derivative of the projection (n, 2, 21) by the corner's camera and board.

    Columns: lens 9, then rotation 3 and translation 3 of T_camera_from_rig, then of T_rig_from_board.
    """
    return _derivatives(_stacked(views), state)


def _derivatives(corners: _Corners, state: State) -> tuple[Array, Array]:
    T_cr, T_rb = state.T_camera_from_rig[corners.camera], state.T_rig_from_board[corners.board]
    R_c = T_cr[:, :3, :3]
    turned = np.einsum("nij,nj->ni", T_rb[:, :3, :3], corners.points)
    rotated = np.einsum("nij,nj->ni", R_c, turned + T_rb[:, :3, 3])
    pixels, by_point, by_lens = project_with_derivatives(state.lenses[corners.camera], rotated + T_cr[:, :3, 3])
    J = np.empty((len(turned), 2, _CAMERA + _POSE))
    J[:, :, :9] = by_lens
    # d(exp(w) v)/dw = -[v]x, and u^T (-[v]x) = (v x u)^T.
    J[:, :, 9:12] = _cross(rotated[:, None, :], by_point)
    J[:, :, 12:15] = by_point
    in_rig = by_point @ R_c
    J[:, :, 15:18] = _cross(turned[:, None, :], in_rig)
    J[:, :, 18:21] = in_rig
    return corners.pixels - pixels, J


def _cross(a: Array, b: Array) -> Array:
    """a x b along the last axis; numpy's own takes four times as long."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def _solve(H: Array, g: Array, chosen: np.ndarray, damping: float) -> Array:
    """The damped step over all unknowns; 0 where held. Marquardt's scaling by the diagonal makes units irrelevant."""
    step = np.zeros(len(g))
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H)[chosen], 1e-30))
    scaled = H[np.ix_(chosen, chosen)] * scale[:, None] * scale[None, :]
    scaled[np.diag_indices_from(scaled)] += damping
    step[chosen] = np.linalg.solve(scaled, g[chosen] * scale) * scale
    return step


def _moved(state: State, step: Array) -> State:
    cameras = len(state.lenses)
    by_camera = step[: cameras * _CAMERA].reshape(cameras, _CAMERA)
    by_board = step[cameras * _CAMERA :].reshape(-1, _POSE)
    places = np.stack([_turned(T, move) for T, move in zip(state.T_camera_from_rig, by_camera[:, LENS_SIZE:], strict=True)])
    boards = np.stack([_turned(T, move) for T, move in zip(state.T_rig_from_board, by_board, strict=True)])
    return replace(state, lenses=state.lenses + by_camera[:, :LENS_SIZE], T_camera_from_rig=places, T_rig_from_board=boards)


def _turned(T: Array, move: Array) -> Array:
    return transform(rotation_from_vector(move[:3]) @ T[:3, :3], T[:3, 3] + move[3:]) if np.any(move) else T


def _result(views: list[View], state: State, H: Array, chosen: np.ndarray, steps: int) -> Adjusted:
    errors = pixel_errors(views, state)
    cameras = len(state.lenses)
    sigma = np.zeros(len(H))
    if len(chosen):
        scale = 1.0 / np.sqrt(np.maximum(np.diag(H)[chosen], 1e-30))
        inverse = np.linalg.pinv(H[np.ix_(chosen, chosen)] * scale[:, None] * scale[None, :], rcond=1e-14, hermitian=True)
        freedom = max(1, 2 * sum(len(error) for error in errors) - len(chosen))
        variance = float(sum(np.sum(error * error) for error in errors)) / freedom
        sigma[chosen] = np.sqrt(np.maximum(np.diag(inverse), 0.0) * variance) * scale
    by_camera = sigma[: cameras * _CAMERA].reshape(cameras, _CAMERA)
    return Adjusted(state, errors, by_camera[:, :LENS_SIZE], by_camera[:, LENS_SIZE:], steps)
