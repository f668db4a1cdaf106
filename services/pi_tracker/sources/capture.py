"""One camera of a capture folder: <camera>.mkv and the stamps in <camera>.csv.

The video holds BGR, or I420 as a grey picture of 3/2 the height (lossless at the camera's own
chroma). Video and stamps must have the same number of frames; where they have not, CaptureError
says how many of how many, after the frames that both have.
"""

from __future__ import annotations

from pathlib import Path

from rhot.errors import CaptureError
from rhot.files.capture import Capture, FrameStamp, read_stamps
from services.pi_tracker.image.frame import Frame, Image, Layout
from services.pi_tracker.sources.notes import Notes
from services.pi_tracker.sources.video_decoder import VideoDecoder


class CaptureReader:
    """Frames of one camera of a capture.

    start_ns, if given, moves the capture's first stamp of any camera there.
    """

    live = False

    def __init__(self, camera: str, folder: Path, start_ns: int | None = None) -> None:
        self.notes = Notes(camera)
        self._camera = camera
        self._capture = Capture(folder)
        self._start_ns = start_ns
        self._decoder = VideoDecoder(self._capture.video(camera))
        self._stamps: list[FrameStamp] = []
        self._shift_ns = 0
        self._index = 0

    def open(self) -> None:
        folder = self._capture.folder
        if not folder.is_dir():
            raise CaptureError(f"{folder}: no such capture folder")
        if not self._capture.video(self._camera).is_file():
            names = ", ".join(sorted(path.stem for path in folder.glob("*.mkv")))
            raise CaptureError(
                f"{folder}: has no video of camera {self._camera!r}; it has {names or 'none'}"
            )
        self._stamps = read_stamps(self._capture.stamps(self._camera))
        if self._start_ns is not None:
            # All cameras' first stamps: each process finds the same one, so that the cameras stay
            # in step.
            first = [
                rows[0].stamp_ns
                for path in sorted(folder.glob("*.csv"))
                if (rows := read_stamps(path))
            ]
            self._shift_ns = self._start_ns - min(first, default=0)
        self._decoder.open()

    def read(self) -> Frame | None:
        image = self._decoder.read()
        if image is None or self._index >= len(self._stamps):
            self._check_end(more=image is not None)
            return None
        stamp = self._stamps[self._index]
        self._index += 1
        return self._frame(stamp, image)

    def _frame(self, stamp: FrameStamp, image: Image) -> Frame:
        height, width = image.shape[:2]
        layout: Layout = "bgr"
        if self._decoder.grey:
            if height % 3 or width % 2:
                raise CaptureError(
                    f"{self._capture.video(self._camera)}: is grey and {width}x{height}; "
                    "a grey video must hold I420 pictures of 3/2 their height"
                )
            layout, height = "i420", height * 2 // 3
        stamp_ns = stamp.stamp_ns + self._shift_ns
        size_px = (width, height)
        return Frame(self._camera, stamp.frame, stamp_ns, stamp.row_time_ns, size_px, image, layout)

    def _check_end(self, *, more: bool) -> None:
        video, stamps = self._capture.video(self._camera), self._capture.stamps(self._camera)
        if more:
            raise CaptureError(
                f"{stamps}: has stamps of {len(self._stamps)} frames, but {video.name} has more: "
                "the capture is damaged"
            )
        if self._index < len(self._stamps):
            raise CaptureError(
                f"{video}: ends after {self._index} of the {len(self._stamps)} frames in "
                f"{stamps.name}: cut short or damaged"
            )

    def close(self) -> None:
        self._decoder.close()
