"""Writes a scene as a capture folder: pictures, stamps, object poses and the ground truth, as a
recording of a rig with synchronised clocks has them.

The same scene and duration give the same bytes. A folder that is not empty is a CaptureError, and
nothing is written.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import msgspec

from rhot.errors import CaptureError, DiskFullError
from rhot.files.calibration import save
from rhot.files.capture import Capture, FrameStamp, write_lines, write_stamps
from rhot.files.config import RigConfig
from rhot.messages.objects import OpenVrPose
from rhot.messages.simulator import Truth
from services.simulator.camera.frame_source import FrameSource
from services.simulator.files.mkv_ids import fix_identifiers, is_cut_off
from services.simulator.files.rig_toml import rig_toml
from services.simulator.hands.families import VARIED
from services.simulator.recorded_motion.bones import RECORDED
from services.simulator.scene.scene import Scene
from services.simulator.scene.vive_trackers import tracker_pose

# When every simulated recording begins, so that the same scene gives the same bytes: 14 November
# 2023.
START_NS = 1_700_000_000 * 1_000_000_000

Progress = Callable[[int, int], None]


def write_capture(
    scene: Scene, seconds: float, folder: Path, progress: Progress | None = None
) -> int:
    """Write `seconds` of a scene into a new or empty folder; returns the number of pictures
    written.

    progress(done, total) is called after each frame of each camera. Raises CaptureError if the
    folder is in use or cannot be written.
    """
    if not seconds > 0.0:
        raise CaptureError(f"cannot write a capture of {seconds} s; give a duration above 0")
    capture = make_folder(folder)
    try:
        copy_rig(scene.config, capture)
        _save_hands(scene, capture)
        write_lines(capture.objects, _object_lines(scene, seconds))
        write_lines(capture.truth, _truth_lines(scene, seconds))
        return _write_pictures(scene, seconds, capture, progress)
    except OSError as error:
        raise CaptureError(f"{folder}: cannot be written: {error}") from None


def make_folder(folder: Path) -> Capture:
    """A new or empty folder for a capture. Raises CaptureError."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise CaptureError(
            f"{folder}: exists and is not an empty folder; name a new one or empty it"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CaptureError(f"{folder}: cannot be made: {error}") from None
    return Capture(folder)


def copy_rig(config: RigConfig, capture: Capture) -> None:
    """rig.toml with this folder as its source, and the calibration of its cameras, hands and
    objects.
    """
    cameras = [msgspec.structs.replace(c, source="capture:.", host="") for c in config.camera]
    objects = msgspec.structs.replace(config.objects, source=f"replay:{capture.objects.name}")
    rig = msgspec.structs.replace(config.rig, calibration="calibration")
    copy = msgspec.structs.replace(config, rig=rig, camera=cameras, objects=objects)
    text = rig_toml(copy, "The rig that made this capture; written by the simulator.")
    capture.rig_toml.write_text(text, encoding="utf-8")
    target = capture.folder / "calibration"
    target.mkdir()
    for path in sorted(config.calibration_dir.glob("*.json")):
        shutil.copyfile(path, target / path.name)


def _save_hands(scene: Scene, capture: Capture) -> None:
    """The hands of a family (hands/families.py) or of a recording, as if somebody had measured
    them.
    """
    for name, hand in scene.hands.items():
        if hand.model.origin in (VARIED, RECORDED):
            save(capture.folder / "calibration" / f"hand.{name}.json", hand.model)


def _object_lines(scene: Scene, seconds: float) -> Iterator[OpenVrPose]:
    rate_hz = scene.config.objects.rate_hz
    for seq in range(int(seconds * rate_hz)):
        t_s = seq / rate_hz
        for index, item in enumerate(scene.objects, start=1):
            yield tracker_pose(scene, item, index, t_s, seq, START_NS + round(t_s * 1e9))


def _truth_lines(scene: Scene, seconds: float) -> Iterator[Truth]:
    """One line at each instant of the first camera, lost frames too, on the master's clock."""
    clock = next(iter(scene.clocks.values()))
    for frame in range(clock.first_frame(seconds)):
        t_s = clock.time_s(frame)
        yield scene.truth(t_s, START_NS + round(t_s * 1e9))


def _write_pictures(
    scene: Scene, seconds: float, capture: Capture, progress: Progress | None
) -> int:
    counts = {name: clock.first_frame(seconds) for name, clock in scene.clocks.items()}
    total = sum(counts.values())
    done, written = 0, 0
    for name, count in counts.items():
        source = FrameSource(scene, name, recorded=True)
        stamps: list[FrameStamp] = []
        fps = scene.config.camera_named(name).fps
        video = _open_video(capture.video(name), fps, source.camera.size_px)
        try:
            for seq in range(count):
                taken = source.take(seq, START_NS)
                if taken.image is not None:
                    # FFV1 stores BGR exactly, and BGR from I420 gives back the same I420: the
                    # chroma of 2x2 equal pixels is its mean.
                    video.write(cv2.cvtColor(taken.image, cv2.COLOR_YUV2BGR_I420))
                    # `frame` is the picture's number in the video.
                    stamps.append(FrameStamp(len(stamps), taken.stamp_ns, taken.row_time_ns))
                done += 1
                if progress is not None:
                    progress(done, total)
        finally:
            video.release()
        # OpenCV does not tell when its writes fail.
        if is_cut_off(capture.video(name)):
            raise DiskFullError(f"{capture.video(name)}: was cut off: no space left for it")
        fix_identifiers(capture.video(name), list(scene.clocks).index(name) + 1)
        write_stamps(capture.stamps(name), stamps)
        written += len(stamps)
    return written


def _open_video(path: Path, fps: float, size_px: tuple[int, int]) -> cv2.VideoWriter:
    codec = cv2.VideoWriter_fourcc(*"FFV1")  # type: ignore[attr-defined]
    video = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, codec, fps, size_px)
    if not video.isOpened():
        raise CaptureError(
            f"{path}: OpenCV cannot write FFV1 here; install opencv-python-headless, whose wheels"
            " bring FFmpeg along"
        )
    return video
