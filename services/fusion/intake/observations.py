"""From a camera's MarkerFrame to observations: colours become landmarks, pixels become rays.

Every marker gets its own instant: a rolling shutter reads row by row, so it is stamp_ns + y_px *
row_time_ns - clock_offset_ns on the master's clock. Frames that cannot be used (a camera that is
not in the rig, another image size than the calibration's, an instant outside the range of stamps)
give a FrameRejection instead of a View. Markers that cannot be used (unknown colour, outside the
image, absurd numbers) are left out and counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numba import njit

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from rhot.hand import HANDS, HandName
from rhot.messages import MarkerFrame
from services.fusion.arrays import Bools, Ints
from services.fusion.intake.undistortion import undistort_all

# No blob's centre is known better than this (measured: .036 px is the best method's noise in the
# best picture) nor useful beyond 20 px.
SIGMA_MIN_PX, SIGMA_MAX_PX = 0.03, 20.0
# A clock off by more than this is as good as unknown; while it is unknown (-1) the estimate must
# not trust motion either.
CLOCK_SIGMA_MAX_S = 0.02
_STAMP_MAX = 2**63 - 1


class FrameRejection(Enum):
    """Why a whole frame is of no use."""

    UNKNOWN_CAMERA = "unknown_camera"
    WRONG_SIZE = "wrong_size"
    IMPLAUSIBLE_STAMP = "absurd_stamp"


@dataclass(frozen=True)
class Landmark:
    """One landmark of one hand: the unit every method of fusion works on, known by its index."""

    hand: HandName
    name: str


class View(NamedTuple):
    """What one camera saw in one frame: n observations, each with its own instant."""

    camera: int  # index into ObservationBuilder.cameras
    instant_ns: int  # master clock, middle row: the frame's own instant
    landmarks: Ints  # (n,) index into ObservationBuilder.landmarks, ascending
    delay_s: Array  # (n,) of each observation after instant_ns
    rays: Array  # (n, 2) undistorted x/z, y/z
    sigmas: Array  # (n,) of each ray coordinate
    areas: Array  # (n,) of the markers, in the rays' units squared
    cut: Bools  # (n,) the picture's edge cuts the marker, and its middle is a guess
    clock_offset_ns: int  # as announced, already taken off
    clock_sigma_s: float
    ignored: int  # markers left out


class Lens(NamedTuple):
    """What of a camera makes rays of its pixels."""

    size_px: tuple[int, int]
    matrix: Array  # (3, 3)
    distortion: Array  # (n,) as Camera.distortion


class ObservationBuilder:
    """Turns the frames of a rig's cameras into Views; holds which colour is which landmark."""

    def __init__(self, config: RigConfig, cameras: Mapping[str, Camera]) -> None:
        self.cameras = tuple(cameras.values())
        self._lenses = [
            Lens((int(camera.size_px[0]), int(camera.size_px[1])), camera.matrix, camera.distortion)
            for camera in self.cameras
        ]
        self._camera_index = {camera.name: index for index, camera in enumerate(self.cameras)}
        landmarks: list[Landmark] = []
        self._landmark_of: dict[str, int] = {}  # colour -> index
        for hand in HANDS:
            if hand in config.hand:
                for name, color in config.hand[hand].marker_names.items():
                    self._landmark_of[color] = len(landmarks)
                    landmarks.append(Landmark(hand, name))
        self.landmarks = tuple(landmarks)
        # Paint on objects' trackers is the object tracker's matter.
        self._of_objects = {item.marker for item in config.object if item.marker}

    def build(self, frame: MarkerFrame) -> View | FrameRejection:
        """The observations of one frame, or why there can be none."""
        index = self._camera_index.get(frame.camera)
        if index is None:
            return FrameRejection.UNKNOWN_CAMERA
        camera = self.cameras[index]
        if tuple(frame.size_px) != tuple(camera.size_px):
            return FrameRejection.WRONG_SIZE
        middle_row = 0.5 * (camera.size_px[1] - 1)
        instant_ns = frame.stamp_ns + round(middle_row * frame.row_time_ns) - frame.clock_offset_ns
        if not 0 <= instant_ns <= _STAMP_MAX:
            return FrameRejection.IMPLAUSIBLE_STAMP
        seen = self._seen(frame, index, middle_row)
        return View(
            index,
            instant_ns,
            *seen,
            clock_offset_ns=frame.clock_offset_ns,
            clock_sigma_s=clock_sigma_s(frame.clock_sigma_ns),
            ignored=self._count_of_hands(frame) - len(seen[0]),
        )

    def _seen(
        self, frame: MarkerFrame, index: int, middle_row: float
    ) -> tuple[Ints, Array, Array, Array, Array, Bools]:
        """Landmarks, delays, rays, sigmas, areas and who is cut, as in View."""
        claimed: list[int] = []
        numbers: list[float] = []
        for marker in frame.markers:
            landmark = self._landmark_of.get(marker.color)
            if landmark is not None:
                claimed.append(landmark)
                numbers += (
                    marker.x_px,
                    marker.y_px,
                    marker.sigma_px,
                    marker.area_px,
                    marker.quality,
                )
        n = len(claimed)
        # To be filled: an array that a kernel returns costs .6 us, one that it is given .2.
        of, delay_s, rays = np.array(claimed, dtype=np.int64), np.empty(n), np.empty((n, 2))
        sigmas, areas, cut = np.empty(n), np.empty(n), np.empty(n, dtype=np.bool_)
        kept = _observe(
            of,
            delay_s,
            rays,
            sigmas,
            areas,
            cut,
            np.array(numbers),
            len(self.landmarks),
            *self._lenses[index],
            middle_row,
            frame.row_time_ns,
        )
        if kept < n:
            return of[:kept], delay_s[:kept], rays[:kept], sigmas[:kept], areas[:kept], cut[:kept]
        return of, delay_s, rays, sigmas, areas, cut

    def _count_of_hands(self, frame: MarkerFrame) -> int:
        if not self._of_objects:
            return len(frame.markers)
        return sum(marker.color not in self._of_objects for marker in frame.markers)


def clock_sigma_s(clock_sigma_ns: int) -> float:
    """How far a camera's clock may be off, in s.

    An unknown offset counts as the most that is still of use.
    """
    if clock_sigma_ns < 0:
        return CLOCK_SIGMA_MAX_S
    return min(clock_sigma_ns * 1e-9, CLOCK_SIGMA_MAX_S)


@njit(cache=True)
def _observe(
    claimed: Ints,
    delay_s: Array,
    rays: Array,
    sigmas: Array,
    areas: Array,
    cut: Bools,
    numbers: Array,
    landmarks: int,
    size_px: tuple[int, int],
    matrix: Array,
    distortion: Array,
    middle_row: float,
    row_time_ns: float,
) -> int:
    """Landmarks, delays, rays, sigmas, areas and cuts as in View, of the best usable markers.

    To the front of arrays (m,), rays (m, 2), of which claimed holds the landmark that each marker
    is of; how many. numbers (5 m,): x, y, sigma, area (px) and quality of each; the camera as in
    Lens.
    """
    of = _best_markers(claimed, numbers.reshape(-1, 5), landmarks, size_px)
    n = of.size
    markers = np.empty((n, 5))
    for k in range(n):
        markers[k] = numbers[5 * of[k] : 5 * of[k] + 5]
    for k in range(n):
        of[k] = claimed[of[k]]
    scale, valid = np.empty(n), np.empty(n, dtype=np.bool_)
    undistort_all(markers, matrix, distortion, rays, scale, valid)
    kept = 0
    for k in range(n):
        if valid[k]:
            claimed[kept] = of[k]
            rays[kept] = rays[k]
            delay_s[kept] = (markers[k, 1] - middle_row) * row_time_ns * 1e-9
            sigmas[kept] = min(max(markers[k, 2], SIGMA_MIN_PX), SIGMA_MAX_PX) * scale[k]
            areas[kept] = markers[k, 3] * scale[k] ** 2
            cut[kept] = _inside_px(markers[k], size_px) < _radius_px(markers[k], size_px)
            kept += 1
    return kept


@njit(cache=True)
def _best_markers(claimed: Ints, markers: Array, landmarks: int, size_px: tuple[int, int]) -> Ints:
    """Which marker (m, 5) is the best usable one of each landmark, ascending; as in _observe."""
    best = np.full(landmarks, -1)
    for n in range(claimed.size):
        # The picture's edge may cut a marker: then its middle is outside, at most by its radius.
        inside = _inside_px(markers[n], size_px) >= -_radius_px(markers[n], size_px)
        if inside and math.isfinite(markers[n, 2]):
            k = claimed[n]
            if best[k] < 0 or markers[n, 4] > markers[best[k], 4]:
                best[k] = n
    return best[best >= 0]


@njit(cache=True)
def _inside_px(marker: Array, size_px: tuple[int, int]) -> float:
    """How far a marker (5,) is within the picture; negative outside, NaN where it is nowhere."""
    x, y = marker[0] + 0.5, marker[1] + 0.5
    inside = min(x, size_px[0] - x, y, size_px[1] - y)
    return inside if math.isfinite(x) and math.isfinite(y) else math.nan


@njit(cache=True)
def _radius_px(marker: Array, size_px: tuple[int, int]) -> float:
    """Of a disc as large as a marker (5,): at most an eighth of the picture's width."""
    return min(math.sqrt(max(marker[3], 0.0) / math.pi), size_px[0] / 8.0)
