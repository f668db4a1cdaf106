"""A recording of a whole hand as one finger's GraspRecording. Pure but for reading the file.

The joints of the finger are brought into the frame of its first bone at zero angles, abduction is
taken out, and what is left is the plane of flexion: x along the straight finger, y towards the
palm. How far the points lie out of that plane, and how far the finger abducts, stands in the notes:
a study in the plane does not see it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np

from rhot.errors import CaptureError
from rhot.geometry.transforms import Array, rotation_from_quaternion
from rhot.hand import DIGITS, HandModel
from services.simulator.recorded_motion.bones import DrivenHand, driven_hand
from services.simulator.recorded_motion.load import load_recording
from services.simulator.recorded_motion.recording import RecordedJoints
from studies.grasp.recorded.points_alone import MARKER_SIGMA_M, solved_hand
from studies.grasp.recording import Angle, Finger, GraspFrame, GraspRecording, Joint

_JOINTS: tuple[Joint, ...] = get_args(Joint)
_ANGLES: tuple[Angle, ...] = get_args(Angle)
_POINTS_ALONE = (
    "wrist and tips were recorded, no joints: the place of the knuckle and the plane of flexion are"
    " the solver's, for an average hand of this one's size. Errors against measured angles cannot"
    " be told"
)


def hand_recording(
    path: Path, finger: Finger, advance: Callable[[], None] = lambda: None
) -> GraspRecording:
    """One finger of the recorded hand at path. advance is called for each frame that is solved.

    Raises CaptureError.
    """
    recorded = load_recording(path)
    driven = driven_hand(recorded) if isinstance(recorded, RecordedJoints) else recorded
    row = DIGITS.index(finger)
    if isinstance(recorded, RecordedJoints) and isinstance(driven, DrivenHand):
        return _of_joints(path, finger, row, recorded, driven)
    points = driven.points() if isinstance(driven, DrivenHand) else driven
    solved = solved_hand(points, advance)
    if solved is None:
        raise CaptureError(
            f"{path}: wrist and tips alone, and no hand fits them; a recording needs the wrist and"
            " three tips in one frame"
        )
    tips = points.points_m[solved.rows, 1 + row] - solved.wrist_m
    local = np.einsum("nji,nj->ni", solved.rotations, tips)[:, None]
    plane, aside = _in_plane(
        local - solved.model.digits[row].base_m, solved.angles_rad[:, row, 0], solved.model, row
    )
    notes = [
        _POINTS_ALONE,
        _told(aside, solved.angles_rad[:, row, 0]),
    ]
    frames = [
        GraspFrame(
            frame=int(number),
            time_s=float(points.times_s[number]),
            points={"tip": (float(x), float(y))},
            points_sigma={"tip": 1e3 * MARKER_SIGMA_M},
        )
        for number, (x, y) in zip(solved.rows.tolist(), plane[:, 0], strict=True)
        if np.isfinite([x, y]).all()
    ]
    return _recording(path, finger, solved.model, notes, frames)


def _of_joints(
    path: Path, finger: Finger, row: int, recorded: RecordedJoints, driven: DrivenHand
) -> GraspRecording:
    """A hand whose joints were recorded: angles and lengths are known."""
    chain = recorded.joints_m[:, row] - recorded.joints_m[:, row, :1]
    local = np.einsum("nji,nkj->nki", recorded.axes, chain)
    abduction = driven.angles_rad[:, row, 0]
    plane, aside = _in_plane(local, abduction, driven.model, row)
    frames = [
        GraspFrame(
            frame=k,
            time_s=float(recorded.times_s[k]),
            points={
                joint: (float(plane[k, j, 0]), float(plane[k, j, 1]))
                for j, joint in enumerate(_JOINTS)
            },
            angles_rad={
                name: float(driven.angles_rad[k, row, j]) for j, name in enumerate(_ANGLES, start=1)
            },
            tip_direction_rad=float(driven.angles_rad[k, row, 1:].sum()),
        )
        for k in range(len(recorded.times_s))
    ]
    return _recording(path, finger, driven.model, [_told(aside, abduction)], frames)


def _recording(
    path: Path, finger: Finger, model: HandModel, notes: list[str], frames: list[GraspFrame]
) -> GraspRecording:
    first, middle, last = model.digits[DIGITS.index(finger)].lengths_m
    return GraspRecording(
        subject=path.name.split(".")[0],
        finger=finger,
        source=path.name,
        method="recording",
        unit="mm",
        lengths=(1e3 * first, 1e3 * middle, 1e3 * last),
        notes=notes,
        frames=frames,
    )


def _in_plane(local_m: Array, abduction: Array, model: HandModel, row: int) -> tuple[Array, Array]:
    """Points (n, k, 3) from the knuckle, wrist frame: (n, k, 2) in the plane, (n, k) beside it; mm.

    The coordinates of services/solver/finger/bending_plane.py.
    """
    base = rotation_from_quaternion(model.digits[row].base_wxyz)
    x, y, z = np.moveaxis(1e3 * local_m @ base, 2, 0)
    x = x * model.side
    s, c = np.sin(abduction)[:, None], np.cos(abduction)[:, None]
    return np.stack([-(s * x + c * z), -y], axis=2), c * x - s * z


def _told(aside_mm: Array, abduction: Array) -> str:
    """How much the plane of flexion leaves out."""
    degrees = np.rad2deg(abduction)
    return (
        f"points lie {np.sqrt(np.nanmean(aside_mm**2)):.1f} mm RMS beside the plane of flexion"
        f" ({np.nanmax(np.abs(aside_mm)):.1f} at most); abduction, taken out, was"
        f" {np.nanmin(degrees):.0f} to {np.nanmax(degrees):.0f} deg"
    )
