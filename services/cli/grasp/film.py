"""A rendered experiment's pictures as a video, or as a folder of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import cv2

from rhot.errors import CaptureError, writing

if TYPE_CHECKING:
    from studies.grasp.scene.experiment import Experiment

# What OpenCV's wheels can write: MPEG-4 part 2, with the blocks and lost detail of H.264, which
# they can only read; FFV1 loses nothing.
_CODECS = {"lossy": ("mp4v", ".mp4"), "lossless": ("FFV1", ".mkv")}


def film(experiment: Experiment, out: Path, kind: str, advance: Callable[[], None]) -> Path:
    """Writes all pictures; returns the video or the folder."""
    name = experiment.subject.name
    if kind == "frames":
        return _frames(experiment, out / name, advance)
    code, suffix = _CODECS[kind]
    path = out / f"{name}{suffix}"
    size, fps = experiment.view.camera.size_px, experiment.options.cycles.fps
    video = open_video(path, code, fps, size)
    try:
        for frame in range(len(experiment)):
            video.write(experiment.picture(frame))
            advance()
    finally:
        video.release()
    return path


def open_video(path: Path, code: str, fps: float, size_px: tuple[int, int]) -> cv2.VideoWriter:
    """A writer of BGR pictures; CaptureError where OpenCV has no such codec."""
    codec = cv2.VideoWriter_fourcc(*code)  # type: ignore[attr-defined]
    video = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, codec, fps, size_px)
    if not video.isOpened():
        raise CaptureError(
            f"{path}: OpenCV cannot write {code} here; is the folder writable, and was OpenCV built"
            " with FFmpeg (pip's opencv-python-headless is)?"
        )
    return video


def _frames(experiment: Experiment, folder: Path, advance: Callable[[], None]) -> Path:
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    for frame in range(len(experiment)):
        path = folder / f"frame-{frame:05d}.png"
        if not cv2.imwrite(str(path), experiment.picture(frame)):
            raise CaptureError(f"{path}: cannot be written; is the disk full?")
        advance()
    return folder
