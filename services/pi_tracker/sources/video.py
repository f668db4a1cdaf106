"""A video file as a frame source, with stamps from the frame's number and the file's frame rate.

A file that does not exist or cannot be decoded, and one that ends before the frames its header
announces, raise CaptureError saying how many frames there were of how many. A video of unknown
frame rate takes the rate of its [[camera]] table.
"""

from __future__ import annotations

from pathlib import Path

from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources.notes import Notes
from services.pi_tracker.sources.numbered_frames import NumberedFrames
from services.pi_tracker.sources.video_decoder import VideoDecoder

# Below and above this no camera's video can be; such a rate is a broken header.
_FPS_RANGE = (0.1, 1000.0)


class VideoReader:
    """Frames of one video file. start_ns is the stamp of its first frame."""

    live = False

    def __init__(self, camera: str, path: Path, fps: float, start_ns: int = 0) -> None:
        self.notes = Notes(camera)
        self._decoder = VideoDecoder(path)
        self._frames = NumberedFrames(camera, fps, start_ns)

    def open(self) -> None:
        self._decoder.open()
        if _FPS_RANGE[0] <= self._decoder.fps <= _FPS_RANGE[1]:
            self._frames.fps = self._decoder.fps

    def read(self) -> Frame | None:
        image = self._decoder.read()
        if image is None:
            self._decoder.check_end(self._frames.count)
            return None
        return self._frames.next(image)

    def close(self) -> None:
        self._decoder.close()
