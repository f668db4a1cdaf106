"""All markers of a run, found before anything is made of them: the clocks come from the whole.

The frames wait in an unnamed file in the result's folder (ten minutes of two cameras at 60 fps are
70 MB, an hour would not fit into the memory of a small computer); where and when markers were seen
is kept as numbers. The file is gone with the process, however that ends.
"""

from __future__ import annotations

import tempfile
from array import array
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import msgspec
import numpy as np

from rhot.errors import writing
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.messages import Marker, MarkerFrame
from services.fusion.alignment.height_track import HeightTrack
from services.fusion.geometry.rectified_pair import rectify_rays
from services.fusion.intake.undistortion import undistort


class RecordedMarkers:
    """Frames of all cameras in the order in which they are added; to be closed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115
        self._decoder = msgspec.json.Decoder(MarkerFrame)
        self._places = array("q")
        self._cameras: list[str] = []
        self._stamps = array("q")  # by the announced offset already
        self._unknown: dict[str, int] = {}
        # By camera and colour: instants on the camera's clock (ns), x and y (px).
        self._seen: dict[str, dict[str, tuple[array[float], array[float], array[float]]]] = {}

    def close(self) -> None:
        """Frames are not needed any more."""
        with suppress(OSError):  # nor is what did not fit on a full disk
            self._file.close()

    def __len__(self) -> int:
        return len(self._places)

    def add(self, frame: MarkerFrame) -> None:
        """Take in a frame. Raises DiskFullError."""
        self._places.append(self._file.tell())
        with writing(self.folder):
            self._file.write(msgspec.json.encode(frame) + b"\n")
        own_ns = frame.stamp_ns - frame.clock_offset_ns
        self._cameras.append(frame.camera)
        self._stamps.append(own_ns)
        self._unknown[frame.camera] = self._unknown.get(frame.camera, 0) + (
            1 if frame.clock_sigma_ns < 0 else -1
        )
        by_color = self._seen.setdefault(frame.camera, {})
        best: dict[str, Marker] = {}
        for marker in frame.markers:
            if marker.color not in best or marker.quality > best[marker.color].quality:
                best[marker.color] = marker
        for color, marker in best.items():
            columns = by_color.setdefault(color, (array("d"), array("d"), array("d")))
            # A row's delay is of microseconds: nanoseconds since the first frame fit a float.
            columns[0].append(own_ns - self._stamps[0] + marker.y_px * frame.row_time_ns)
            columns[1].append(marker.x_px)
            columns[2].append(marker.y_px)

    def unknown(self, camera: str) -> bool:
        """Whether a camera's clock is unknown, by what most of its frames say."""
        return self._unknown.get(camera, 0) > 0

    def span_ns(self, camera: str) -> tuple[int, int]:
        """A camera's first and last instant, on its own clock; (0, 0) without frames."""
        own = [s for s, name in zip(self._stamps, self._cameras, strict=True) if name == camera]
        return (min(own), max(own)) if own else (0, 0)

    def frames(self, key: Callable[[str, int], int] | None = None) -> Iterator[MarkerFrame]:
        """All frames as they were added, or by key(camera, instant on its clock) and camera."""
        order = range(len(self._places))
        if key is not None:
            keys = [
                (key(camera, stamp), camera)
                for camera, stamp in zip(self._cameras, self._stamps, strict=True)
            ]
            order = sorted(order, key=keys.__getitem__)  # type: ignore[assignment]
        with writing(self.folder):
            self._file.flush()
        for k in order:
            self._file.seek(self._places[k])
            yield self._decoder.decode(self._file.readline())

    def heights(
        self, camera: Camera, R_rectified_from_camera: Array, epoch_ns: int
    ) -> dict[str, HeightTrack]:
        """Each colour's heights in a camera, on its own clock, s since epoch_ns."""
        found = {}
        first_ns = self._stamps[0] if self._stamps else 0
        for color, (times, x, y) in self._seen.get(camera.name, {}).items():
            times_s = (np.array(times) + float(first_ns - epoch_ns)) * 1e-9
            rays, _, valid = undistort(camera, np.column_stack([x, y]))
            heights = rectify_rays(R_rectified_from_camera, rays)[:, 1]
            times_s, heights = times_s[valid], heights[valid]
            # In the order of its instants: rows of a marker may overtake those of a frame before.
            known = np.flatnonzero(np.isfinite(heights))
            known = known[np.argsort(times_s[known], kind="stable")]
            known = known[np.diff(times_s[known], prepend=-np.inf) > 0.0]
            if len(known):
                found[color] = HeightTrack(times_s[known], heights[known])
        return found
