"""The normal equations of a bundle adjustment, boards eliminated by a Schur complement. Pure.

Triggs et al., "Bundle Adjustment - A Modern Synthesis" (1999), sections 4 and 6. No two boards meet
in a picture, so the boards' part of the Hessian is block diagonal: what is left after eliminating
them has 15 unknowns per camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array
from services.calibrator.bundle.residuals import (
    CAMERA_SIZE,
    POSE_SIZE,
    Corners,
    State,
    residuals_and_jacobian,
)

# Added to the Hessian of a board (px^2): no corner constrains what is this weak.
_BOARD_FLOOR = 1e-12


def robust_cost(squared: Array, soft_px: float) -> float:
    """Sum of soft_l1, rho(s) = 2 (sqrt(1 + s) - 1), over squared residuals in units of soft_px.

    Infinite where a residual is not finite.
    """
    if not np.all(np.isfinite(squared)):
        return float("inf")
    return soft_px**2 * float(np.sum(2.0 * (np.sqrt(1.0 + squared) - 1.0)))


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """The robust cost, and its Gauss-Newton Hessian and gradient over all unknowns, free or not.

    Cameras have m unknowns together, each of the b boards has six.
    """

    cost: float
    H_cameras: Array  # (m, m)
    H_boards: Array  # (b, 6, 6)
    H_mixed: Array  # (b, m, 6)
    g_cameras: Array  # (m,)
    g_boards: Array  # (b, 6)

    def solve(self, free: np.ndarray, boards: bool, damping: float) -> tuple[Array, Array]:
        """The damped step of the cameras (m,) and of the boards (b, 6); 0 where held.

        `free` are the numbers of the camera unknowns that may move. Marquardt's scaling: the
        diagonal is raised by a share of itself, so that units do not matter.
        """
        camera_step = np.zeros(len(self.H_cameras))
        board_step = np.zeros_like(self.g_boards)
        H_boards = self._damped_boards(damping)
        if len(free):
            H, gradient = self._reduced(free, H_boards if boards else None, damping)
            scale = _unit_diagonal(H)
            scaled = H * scale[:, None] * scale + 1e-13 * np.eye(len(H))
            camera_step[free] = np.linalg.solve(scaled, gradient * scale) * scale
        if boards:
            right = self.g_boards - np.einsum("bmk,m->bk", self.H_mixed, camera_step)
            board_step = np.linalg.solve(H_boards, right[..., None])[..., 0]
        return camera_step, board_step

    def camera_variance(self, free: np.ndarray, boards: bool) -> Array:
        """Variance (m,) of each camera unknown for residuals of 1 px; 0 where held.

        All other unknowns count as unknown too: this is the diagonal of the inverse Hessian.
        """
        variance = np.zeros(len(self.H_cameras))
        if not len(free) or not np.isfinite(self.cost):
            variance[free] = np.inf
            return variance
        H, _ = self._reduced(free, self._damped_boards(0.0) if boards else None, 0.0)
        scale = _unit_diagonal(H)
        inverse = np.linalg.pinv(H * scale[:, None] * scale, rcond=1e-14, hermitian=True)
        variance[free] = np.maximum(np.diag(inverse), 0.0) * scale**2
        return variance

    def _damped_boards(self, damping: float) -> Array:
        """The damped Hessian (b, 6, 6) of the boards."""
        identity = np.eye(POSE_SIZE)
        return self.H_boards + damping * self.H_boards * identity + _BOARD_FLOOR * identity

    def _reduced(
        self, free: np.ndarray, H_boards: Array | None, damping: float
    ) -> tuple[Array, Array]:
        """The damped Hessian (f, f) and gradient (f,) of the free camera unknowns.

        The boards are eliminated if their Hessian is given (Schur complement).
        """
        H = self.H_cameras[np.ix_(free, free)]
        H = H + damping * np.diag(np.diag(H))
        gradient = self.g_cameras[free]
        if H_boards is None:
            return H, gradient
        mixed = self.H_mixed[:, free]  # (b, f, 6)
        solved = np.linalg.solve(H_boards, mixed.transpose(0, 2, 1))  # (b, 6, f)
        return (
            H - np.einsum("bck,bkd->cd", mixed, solved),
            gradient - np.einsum("bkc,bk->c", solved, self.g_boards),
        )


def _unit_diagonal(H: Array) -> Array:
    """The scale (n,) of the unknowns that gives the Hessian (n, n) a diagonal of ones."""
    return 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-30))


def normal_equations(corners: Corners, state: State, soft_px: float) -> NormalEquations:
    """The normal equations at a state; residuals beyond about soft_px lose weight."""
    unknowns, boards = len(state.lenses) * CAMERA_SIZE, len(state.T_rig_from_board)
    H_cameras = np.zeros((unknowns, unknowns))
    H_boards = np.zeros((boards, POSE_SIZE, POSE_SIZE))
    H_mixed = np.zeros((boards, unknowns, POSE_SIZE))
    g_cameras = np.zeros(unknowns)
    g_boards = np.zeros((boards, POSE_SIZE))
    residual, J = residuals_and_jacobian(corners, state)
    squared = np.sum(residual * residual, axis=1) / soft_px**2
    weighted = J / np.sqrt(1.0 + squared)[:, None, None]  # rho'(s) J
    begin = 0
    for end in corners.ends:
        J_view = J[begin:end].reshape(-1, CAMERA_SIZE + POSE_SIZE)
        weighted_view = weighted[begin:end].reshape(-1, CAMERA_SIZE + POSE_SIZE)
        H = weighted_view.T @ J_view
        g = weighted_view.T @ residual[begin:end].reshape(-1)
        board, first = corners.board[begin], corners.camera[begin] * CAMERA_SIZE
        camera = slice(first, first + CAMERA_SIZE)
        H_cameras[camera, camera] += H[:CAMERA_SIZE, :CAMERA_SIZE]
        H_boards[board] += H[CAMERA_SIZE:, CAMERA_SIZE:]
        H_mixed[board, camera] += H[:CAMERA_SIZE, CAMERA_SIZE:]
        g_cameras[camera] += g[:CAMERA_SIZE]
        g_boards[board] += g[CAMERA_SIZE:]
        begin = end
    cost = robust_cost(squared, soft_px)
    return NormalEquations(cost, H_cameras, H_boards, H_mixed, g_cameras, g_boards)
