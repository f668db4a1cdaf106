"""What a rendered experiment leaves beside its video: truth, first clicks, camera, rectangle.

The truth is a GraspRecording as measuring writes it; the scene's file says what no measurement
knows: lens, homography, where the reference is, which edges are straight in the world.
"""

from __future__ import annotations

import msgspec
import numpy as np

from rhot.files.calibration import Lens
from rhot.geometry.transforms import Array
from studies.grasp.recording import ANGLES, JOINTS, GraspFrame, GraspRecording
from studies.grasp.scene.backdrop import straight_lines
from studies.grasp.scene.experiment import INDEX_JOINTS, THUMB_JOINTS, Experiment
from studies.grasp.scene.hand import THUMB_BASE

Pixel = tuple[float, float]


class Reference(msgspec.Struct, frozen=True, kw_only=True):
    """The rectangle: corners in the picture (lens included) and in the plane, upper left, upper
    right, lower right, lower left; z_mm: how far its plane lies behind the finger's.
    """

    corners_px: list[Pixel]
    corners_mm: list[Pixel]
    size_mm: Pixel
    z_mm: float


class SceneFile(msgspec.Struct, frozen=True, kw_only=True):
    """<subject>.scene.json. homography takes mm of the finger's plane to pixels of a picture
    without distortion; T_plane_from_camera in metres. straight_lines: pixels along edges that
    are straight in the world.
    """

    subject: str
    seed: int
    fps: float
    size_px: tuple[int, int]
    matrix: list[list[float]]
    distortion: list[float]
    T_plane_from_camera: list[list[float]]
    homography: list[list[float]]
    reference: Reference
    straight_lines: list[list[Pixel]]


def truth_of(experiment: Experiment) -> list[GraspRecording]:
    """The index finger's recording, and the thumb's where it has dots, too."""
    motion, subject = experiment.motion, experiment.subject
    frames = range(len(experiment))
    joints = [experiment.joints(frame) for frame in frames]
    fingers = [("index", subject.lengths, INDEX_JOINTS, motion.angles)]
    if experiment.options.thumb:
        fingers.append(("thumb", subject.thumb, THUMB_JOINTS, motion.thumb))
    return [
        GraspRecording(
            subject=subject.name,
            finger=finger,  # type: ignore[arg-type]
            method="truth",
            unit="mm",
            lengths=lengths,
            lengths_sigma=(0.0, 0.0, 0.0),
            notes=_notes(experiment, finger),
            frames=[
                GraspFrame(
                    frame=frame,
                    time_s=float(motion.time_s[frame]),
                    points=_points(joints[frame], names),
                    angles_rad=_angles(angles[frame]),
                    tip_direction_rad=float(angles[frame].sum()),
                )
                for frame in frames
            ],
        )
        for finger, lengths, names, angles in fingers
    ]


def _notes(experiment: Experiment, finger: str) -> list[str]:
    notes = ["rendered"]
    if experiment.options.thumb:
        # From the line between two dots angles are larger by this.
        off = np.degrees(np.arctan2(THUMB_BASE[1], -THUMB_BASE[0]))
        notes.append(
            f"the base line is the back of the hand's; that from thumb_cmc to index_mcp would make"
            f" the first angle {off:.2f} degrees larger"
        )
    if finger == "thumb":
        notes.append(
            "mcp, pip, dip are the thumb's CMC, MP and IP joints, in the index finger's frame:"
            " where it opposes the finger its angles are negative"
        )
    return notes


def _angles(angles: Array) -> dict:
    return dict(zip(ANGLES, angles.tolist(), strict=True))


def _points(joints: dict[str, Array], names: tuple[str, ...]) -> dict:
    return {
        joint: (float(joints[name][0]), float(joints[name][1]))
        for joint, name in zip(JOINTS, names, strict=True)
    }


def seeds_of(experiment: Experiment) -> dict[str, Pixel]:
    """Where somebody would click in the first picture: joint -> x, y px. `base` is a second point
    of the base line, which has no dot where the thumb's joints have theirs.
    """
    thumb = experiment.options.thumb
    wanted = (*INDEX_JOINTS, *THUMB_JOINTS) if thumb else ("base", *INDEX_JOINTS)
    pixels = experiment.pixels_of(0)
    return {name: _rounded(pixels[name][None])[0] for name in wanted}


def pixel_table(experiment: Experiment) -> str:
    """CSV: frame, cycle, closing and each joint's pixel."""
    names = list(experiment.pixels_of(0))
    head = ["frame", "cycle", "closing", *(f"{name}_{axis}" for name in names for axis in "xy")]
    rows = [",".join(head)]
    for frame in range(len(experiment)):
        pixels = np.stack(list(experiment.pixels_of(frame).values())).reshape(-1)
        phase = (int(experiment.motion.cycle[frame]), int(experiment.motion.closing[frame]))
        rows.append(",".join([str(frame), *map(str, phase), *(f"{one:.3f}" for one in pixels)]))
    return "\n".join(rows) + "\n"


def scene_file(experiment: Experiment) -> SceneFile:
    """What is known of camera and reference."""
    view, rectangle = experiment.view, experiment.options.rectangle
    return SceneFile(
        subject=experiment.subject.name,
        seed=experiment.seed,
        fps=experiment.options.cycles.fps,
        size_px=view.camera.size_px,
        matrix=view.camera.matrix.tolist(),
        distortion=view.camera.distortion.tolist(),
        T_plane_from_camera=view.camera.T_rig_from_camera.tolist(),
        homography=view.homography.tolist(),
        reference=Reference(
            corners_px=_rounded(view.pixels(rectangle.corners, rectangle.z)),
            corners_mm=_rounded(rectangle.corners),
            size_mm=rectangle.size,
            z_mm=rectangle.z,
        ),
        straight_lines=[
            _rounded(line) for line in straight_lines(view, rectangle, experiment.seed)
        ],
    )


def lens_of(experiment: Experiment) -> Lens:
    """The lens as `rhot calibrate lens` writes it."""
    camera = experiment.view.camera
    return Lens(
        tool="rhot grasp render",
        size_px=camera.size_px,
        matrix=tuple(tuple(row) for row in camera.matrix.tolist()),  # type: ignore[arg-type]
        distortion=tuple(camera.distortion.tolist()),
    )


def _rounded(points: Array) -> list[Pixel]:
    return [(round(float(x), 3), round(float(y), 3)) for x, y in points]
