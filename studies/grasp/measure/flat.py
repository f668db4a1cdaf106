"""A picture as a camera that looks straight at the finger's plane would have it. Pure.

Seen askance, a bone looks longer or shorter as it turns: a camera tilted by 10 deg changes a short
phalanx by 5 to 10 % from an open hand to a fist. What takes bones for rigid measures in the flat
picture, and its places are carried back.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np

from rhot.geometry.transforms import Array
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.image.yuv_planes import bgr_image
from studies.grasp.measure.joints import Seen
from studies.grasp.measure.seeds import Seeds
from studies.grasp.metrology.plane import Plane, project

# A plane seen very much askance would have an endless picture: what lies further out is left out.
_LARGEST = 2.0


class Flat(NamedTuple):
    """flat_from_picture (3, 3), a homography between pixels, as large about the seeds in both; the
    size of the flat picture, which shows all of the other.
    """

    flat_from_picture: Array
    size_px: tuple[int, int]

    def frame(self, frame: Frame) -> Frame:
        """The flat picture."""
        seen = cv2.warpPerspective(bgr_image(frame), self.flat_from_picture, self.size_px)
        image = np.asarray(seen, dtype=np.uint8)
        return replace(frame, image=image, layout="bgr", size_px=self.size_px)

    def seeds(self, seeds: Seeds) -> Seeds:
        """Places of the picture in the flat one."""
        moved = project(self.flat_from_picture, list(seeds.values())).tolist()
        return {name: (x, y) for name, (x, y) in zip(seeds, moved, strict=True)}

    def back(self, seen: Seen) -> Seen:
        """What was seen in the flat picture, in pixels of the camera's."""
        if not seen.places:
            return seen
        picture_from_flat: Array = np.asarray(np.linalg.inv(self.flat_from_picture), np.float64)
        at = np.array([(place.x_px, place.y_px) for place in seen.places.values()])
        here = project(picture_from_flat, at)
        right, down = (project(picture_from_flat, at + step) - here for step in np.eye(2))
        scale = np.sqrt(np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0]))
        places = {
            name: place._replace(x_px=float(x), y_px=float(y), sigma_px=place.sigma_px * float(s))
            for (name, place), (x, y), s in zip(seen.places.items(), here, scale, strict=True)
        }
        return seen._replace(places=places)


def flat_about(plane: Plane, seeds: Seeds, size_px: tuple[int, int]) -> Flat:
    """The view straight at a plane which shows the seeds as large as the picture of that size."""
    at = np.mean(list(seeds.values()), axis=0)
    mm = plane.to_mm(at[None])[0]
    columns = [(plane.to_px([mm + step]) - plane.to_px([mm - step]))[0] / 2.0 for step in np.eye(2)]
    # The closest turn, or turn and mirroring, of one size for both axes.
    left, sizes, right = np.linalg.svd(np.column_stack(columns))
    similar = np.eye(3)
    similar[:2, :2] = sizes.mean() * (left @ right)
    similar[:2, 2] = at - similar[:2, :2] @ mm
    return _covering(similar @ np.linalg.inv(plane.image_from_plane), at, size_px)


def _covering(flat_from_picture: Array, at: Array, size_px: tuple[int, int]) -> Flat:
    """Moved so that all of the picture is shown; `at` is a place that both have in common."""
    width, height = size_px
    most = np.array(size_px) * _LARGEST
    corners = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])
    # In front of the camera are those with the same sign as the seeds.
    lifted = np.column_stack([corners, np.ones(4)]) @ flat_from_picture.T
    ahead = lifted[:, 2] * (flat_from_picture @ (*at, 1.0))[2] > 0.0
    shown = lifted[:, :2] / lifted[:, 2:]
    low = np.maximum(np.where(ahead.all(), shown.min(axis=0), -np.inf), at - most / 2.0)
    high = np.minimum(np.where(ahead.all(), shown.max(axis=0), np.inf), at + most / 2.0)
    moved = np.eye(3)
    moved[:2, 2] = -low
    # Even numbers: colour is known of two by two pixels.
    columns, rows = (int(2 * np.ceil(side / 2.0)) for side in high - low)
    return Flat(moved @ flat_from_picture, (columns, rows))
