"""Pictures with a side cut away, and the cameras that take them: hands at the view's edge. Pure."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.pi_tracker.image.frame import Frame, Image

Side = Literal["left", "right", "top", "bottom"]
# The picture's size must be one that I420 has.
_STEP_PX = 4


@dataclass(frozen=True)
class Crop:
    """What is left of a picture where a side is cut away at a column or row."""

    side: Side
    at_px: int

    @property
    def axis(self) -> int:
        """0 where columns are cut away, 1 where rows are."""
        return 0 if self.side in ("left", "right") else 1

    @property
    def ahead(self) -> bool:
        """Whether the columns or rows with the largest numbers are cut away."""
        return self.side in ("right", "bottom")

    def origin_px(self) -> tuple[int, int]:
        """The first column and row that are left."""
        at = 0 if self.ahead else self.at_px
        return (at, 0) if self.axis == 0 else (0, at)

    def size_px(self, whole_px: tuple[int, int]) -> tuple[int, int]:
        """Of what is left."""
        size = list(whole_px)
        size[self.axis] = self.at_px if self.ahead else size[self.axis] - self.at_px
        return size[0], size[1]

    def inside_px(self, place_px: Array) -> float:
        """How far a place of the whole picture is within the edge; negative outside."""
        inside = self.at_px - 0.5 - float(place_px[self.axis])
        return inside if self.ahead else -inside

    def of_frame(self, frame: Frame) -> Frame:
        """An I420 picture; rows that are left keep their instants."""
        width, height = frame.size_px
        (x, y), size = self.origin_px(), self.size_px(frame.size_px)
        luma, chroma = frame.image[:height], frame.image[height:].reshape(2, height // 2, -1)
        parts: list[Image] = [luma[y : y + size[1], x : x + size[0]]]
        for plane in chroma.reshape(2, height // 2, width // 2):
            half = plane[y // 2 : (y + size[1]) // 2, x // 2 : (x + size[0]) // 2]
            parts.append(np.ascontiguousarray(half).reshape(-1, size[0]))
        return dataclasses.replace(
            frame,
            stamp_ns=frame.stamp_ns + round(y * frame.row_time_ns),
            size_px=size,
            image=np.ascontiguousarray(np.concatenate(parts)),
        )

    def of_camera(self, camera: Camera) -> Camera:
        """The camera that takes what is left."""
        x, y = self.origin_px()
        matrix = camera.matrix - np.array([[0.0, 0.0, x], [0.0, 0.0, y], [0.0, 0.0, 0.0]])
        return dataclasses.replace(camera, size_px=self.size_px(camera.size_px), matrix=matrix)


def crops_through(places_px: Array, shares: tuple[float, ...]) -> list[Crop]:
    """Cuts of each side through places (n, 2), between their outermost at these shares."""
    low, high = np.percentile(places_px, [3.0, 97.0], axis=0)
    found = []
    for side in ("left", "right", "top", "bottom"):
        axis = 0 if side in ("left", "right") else 1
        for share in shares:
            at = low[axis] + share * (high[axis] - low[axis])
            found.append(Crop(side, int(at) // _STEP_PX * _STEP_PX))
    return found
