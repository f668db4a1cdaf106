"""Rendered pictures of grasp experiments as frames, 12 a second."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from services.pi_tracker.image.frame import Frame


def frame_of(image: npt.NDArray[np.uint8], number: int) -> Frame:
    """A picture (h, w, 3), BGR, as the frame of that number."""
    height, width = image.shape[:2]
    return Frame("grasp", number, round(1e9 * number / 12), 0.0, (width, height), image, "bgr")
