"""Bundle adjustment: the lenses, extrinsics and board poses that explain all corners best. Pure.

Levenberg-Marquardt on the normal equations, each corner weighted by soft_l1 (Triggs et al., "Bundle
Adjustment - A Modern Synthesis", 1999). The same function calibrates one lens, a rig, or only the
pose of a board. Rotations are updated by small rotations from the left, exp(w) R, so no angle is
singular. A problem that leaves an unknown undetermined still returns, with a large sigma: nothing
here refuses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array, rotation_from_vector, transform
from services.calibrator.bundle.lens_model import LENS_SIZE
from services.calibrator.bundle.normal_equations import (
    NormalEquations,
    normal_equations,
    robust_cost,
)
from services.calibrator.bundle.residuals import (
    CAMERA_SIZE,
    POSE_SIZE,
    Corners,
    State,
    View,
    residuals,
    rms,
    split_by_view,
    stack_corners,
)

# A corner with a residual of this many px begins to lose weight. Corners of sharp pictures are off
# by .1-.3 px.
_SOFT_PX = 1.0
_MAX_STEPS = 60
# Relative change of the cost that ends the search: with 3000 corners the unknowns are then within
# .02 of their sigma.
_STOP = 1e-7
# Beyond this damping no step is small enough to lower the cost: this is the minimum.
_MAX_DAMPING = 1e9


@dataclass(frozen=True, eq=False)
class FreeUnknowns:
    """What may change: numbers of each lens, the extrinsics of each camera, all boards or none."""

    lens: np.ndarray  # (c, 9) bool
    extrinsics: np.ndarray  # (c,) bool
    boards: bool = True

    @staticmethod
    def one_lens(lens: np.ndarray) -> FreeUnknowns:
        """Of one camera, these lens numbers (9,) bool and the poses of its boards."""
        return FreeUnknowns(lens[None], np.array([False]))

    @staticmethod
    def boards_only(cameras: int) -> FreeUnknowns:
        """The poses of the boards; all cameras are held."""
        return FreeUnknowns(np.zeros((cameras, LENS_SIZE), dtype=bool), np.zeros(cameras, bool))

    def camera_unknowns(self) -> np.ndarray:
        """Positions (f,) of the free ones among the 15 unknowns of each camera."""
        extrinsics = np.repeat(self.extrinsics[:, None], POSE_SIZE, axis=1)
        return np.flatnonzero(np.concatenate([self.lens, extrinsics], axis=1))


@dataclass(frozen=True, eq=False)
class Adjustment:
    """The state found, the residuals (n, 2) px of each view, and one sigma; 0 where held.

    The sigma of the extrinsics is that of the small rotation (rad) and of the translation (m) of
    T_camera_from_rig.
    """

    state: State
    residuals: tuple[Array, ...]
    lens_sigma: Array  # (c, 9)
    extrinsics_sigma: Array  # (c, 6)

    @property
    def rms_px(self) -> float:
        """Reprojection error: RMS distance between a corner and its projection."""
        return rms(np.concatenate(self.residuals)) if self.residuals else 0.0


def adjust(views: list[View], start: State, free: FreeUnknowns) -> Adjustment:
    """Adjust the free unknowns to the views; at the start, boards are in front of their cameras."""
    corners, unknowns = stack_corners(views), free.camera_unknowns()
    state, damping = start, 1e-3
    equations = normal_equations(corners, state, _SOFT_PX)
    for _ in range(_MAX_STEPS):
        if not np.isfinite(equations.cost) or not (len(unknowns) or free.boards):
            break
        proposal = _updated(state, *equations.solve(unknowns, free.boards, damping))
        cost = _cost(corners, proposal)
        if not cost < equations.cost:
            damping *= 8.0
            if damping > _MAX_DAMPING:
                break
            continue
        gain = equations.cost - cost
        state, damping = proposal, max(damping / 6.0, 1e-12)
        equations = normal_equations(corners, state, _SOFT_PX)
        if gain <= _STOP * cost + 1e-15:
            break
    return _adjustment(corners, state, equations, free)


def _cost(corners: Corners, state: State) -> float:
    residual = residuals(corners, state)
    return robust_cost(np.sum(residual * residual, axis=1) / _SOFT_PX**2, _SOFT_PX)


def _updated(state: State, camera_step: Array, board_step: Array) -> State:
    by_camera = camera_step.reshape(len(state.lenses), CAMERA_SIZE)
    return State(
        lenses=state.lenses + by_camera[:, :LENS_SIZE],
        T_camera_from_rig=_moved(state.T_camera_from_rig, by_camera[:, LENS_SIZE:]),
        T_rig_from_board=_moved(state.T_rig_from_board, board_step),
    )


def _moved(poses: Array, steps: Array) -> Array:
    """Poses (k, 4, 4) after steps (k, 6) of rotation and translation."""
    return np.stack([_moved_pose(T, step) for T, step in zip(poses, steps, strict=True)])


def _moved_pose(T: Array, step: Array) -> Array:
    # A held pose keeps its exact numbers.
    if not np.any(step):
        return T
    return transform(rotation_from_vector(step[:3]) @ T[:3, :3], T[:3, 3] + step[3:])


def _adjustment(
    corners: Corners, state: State, equations: NormalEquations, free: FreeUnknowns
) -> Adjustment:
    residual = residuals(corners, state)
    unknowns = free.camera_unknowns()
    count = len(unknowns) + (POSE_SIZE * len(state.T_rig_from_board) if free.boards else 0)
    variance = float(np.sum(residual * residual)) / max(1, residual.size - count)
    sigma = np.sqrt(variance * equations.camera_variance(unknowns, free.boards))
    sigma = sigma.reshape(len(state.lenses), CAMERA_SIZE)
    return Adjustment(
        state=state,
        residuals=split_by_view(corners, residual),
        lens_sigma=sigma[:, :LENS_SIZE],
        extrinsics_sigma=sigma[:, LENS_SIZE:],
    )
