"""One colour of paint as all cameras saw it: pixels of marker frames as rays with instants. Pure.

Every marker has its own instant: cameras run freely and read row by row. Frames of cameras that are
not in the rig are passed over, as are markers without a ray in the lens model; a picture size other
than the lens calibration's is a CalibrationError.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.messages import MarkerFrame
from services.calibrator.bundle.picture_size import check_size

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

# No centroid is better: rounding in messages and what lenses leave, px.
_MIN_SIGMA_PX = 0.02


@dataclass(frozen=True, eq=False)
class Sightings:
    """What C cameras saw of one colour, n times in the order of their instants.

    frames (C,) counts all frames, those without this colour too.
    """

    color: str
    cameras: tuple[Camera, ...]
    frames: Ints  # (C,)
    camera: Ints  # (n,), index into cameras
    stamps_ns: Ints  # (n,), on the master's clock
    pixels: Array  # (n, 2)
    rays: Array  # (n, 2), undistorted, x/z and y/z
    sigma_px: Array  # (n,)
    area_px: Array  # (n,)

    def __len__(self) -> int:
        return len(self.camera)

    @property
    def focals_px(self) -> Array:
        """The mean focal length of each sighting's camera; (n,)."""
        focals = np.array([float(np.mean(camera.focal_px)) for camera in self.cameras])
        return focals[self.camera]

    def seconds_from(self, begin_ns: int) -> Array:
        """The instants (n,) in seconds since begin_ns: float64 cannot hold those since 1970."""
        return np.asarray((self.stamps_ns - begin_ns) * 1e-9, dtype=np.float64)

    def only(self, wanted: Bools | Ints) -> Sightings:
        """Those of a mask, or of numbers."""
        return replace(
            self,
            camera=self.camera[wanted],
            stamps_ns=self.stamps_ns[wanted],
            pixels=self.pixels[wanted],
            rays=self.rays[wanted],
            sigma_px=self.sigma_px[wanted],
            area_px=self.area_px[wanted],
        )


def sightings(
    frames: Iterable[MarkerFrame], cameras: Mapping[str, Camera], color: str
) -> Sightings:
    """All sightings of one colour in the frames of these cameras.

    Raises CalibrationError for frames of another picture size than their camera's lens.
    """
    names = list(cameras)
    counts = np.zeros(len(names), dtype=np.int64)
    rows: list[tuple[int, int, float, float, float, float]] = []
    for frame in frames:
        if frame.camera not in cameras:
            continue
        check_size(frame, cameras[frame.camera])
        number = names.index(frame.camera)
        counts[number] += 1
        begin_ns = frame.stamp_ns - frame.clock_offset_ns
        rows += [
            (
                number,
                begin_ns + round(marker.y_px * frame.row_time_ns),
                marker.x_px,
                marker.y_px,
                max(marker.sigma_px, _MIN_SIGMA_PX),
                marker.area_px,
            )
            for marker in frame.markers
            if marker.color == color
        ]
    return _gather(color, tuple(cameras.values()), counts, rows)


def _gather(
    color: str,
    cameras: tuple[Camera, ...],
    counts: Ints,
    rows: list[tuple[int, int, float, float, float, float]],
) -> Sightings:
    # A frame may come twice; two blobs of one colour in a frame contradict each other, and the loss
    # of the fit decides.
    rows = sorted(set(rows), key=lambda row: row[1])
    camera = np.array([row[0] for row in rows], dtype=np.int64)
    stamps_ns = np.array([row[1] for row in rows], dtype=np.int64)
    numbers = np.array([row[2:] for row in rows], dtype=np.float64).reshape(-1, 4)
    rays = np.full((len(rows), 2), np.nan)
    for c, one in enumerate(cameras):
        rays[camera == c] = one.rays_from_pixels(numbers[camera == c, :2])
    pixels, sigma_px, area_px = numbers[:, :2], numbers[:, 2], numbers[:, 3]
    found = Sightings(color, cameras, counts, camera, stamps_ns, pixels, rays, sigma_px, area_px)
    return found.only(np.isfinite(rays).all(axis=1))
