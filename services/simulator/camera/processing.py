"""What a Raspberry Pi's image processor does to a picture by default, and rhot switches off: it
denoises, then sharpens; and what a webcam does that sends JPEG. Pure: of one picture alone.

A model after libcamera's control algorithms (src/ipa/rpi/controller/rpi: denoise.cpp, sharpen.cpp),
whose numbers feed hardware that is not described. Not compared with a Pi.
    denoise   an edge-preserving (bilateral) mean of 5x5 luma pixels as far as they differ by no
              more than noise does, and of 5x5 chroma cells, which takes small colour differences
              for noise. The Pi 5's mean over time is left out: it would make a picture depend on
              those before it, and it backs off where something moves.
    jpeg      each plane by itself, as JPEG with halved chroma codes them, but that chroma is
              quantised like luma here.
    sharpen   an unsharp mask on luma: what a Gaussian takes away is added, less a threshold that
              leaves noise alone, up to a limit. Threshold and limit follow the square root of the
              strength, as in libcamera. At strength 1 an edge that a lens has blurred overshoots by
              a tenth.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from rhot.files.simulator_table import Simulator

Bytes = npt.NDArray[np.uint8]

# Standard deviation of luma and chroma for noise of one grey level in each colour channel
# (tests/services/simulator/render/test_renderer.py measures them).
_LUMA_SIGMA, _CHROMA_SIGMA = 0.57, 0.45
# "deviation": 3.2 in the Pi's tuning files: what differs by so many standard deviations is an edge.
_DEVIATION = 3.2
# Colour noise is given a much wider range ("cdn": 120 to 200), but less weight (0.3 beside 0.75).
_CHROMA_DEVIATION, _CHROMA_SHARE = 12.0, 0.4
_WINDOW, _WINDOW_SIGMA = 5, 1.5
# The overshoot of a tenth is this gain's.
_BLUR_PX, _GAIN = 1.2, 2.0
# Grey levels at strength 1: most noise is not sharpened, no edge overshoots by more than 32.
_THRESHOLD, _LIMIT = 2.5, 32.0


def processed(image: Bytes, noise: float, settings: Simulator) -> Bytes:
    """An I420 picture (h * 3 / 2, w) denoised, sharpened and compressed as [simulator] says.

    noise is that of each colour channel, grey levels. Nothing asked for: the same picture.
    """
    if not (settings.sharpen or settings.denoise or settings.jpeg):
        return image
    height, width = image.shape[0] * 2 // 3, image.shape[1]
    luma, chroma = image[:height], image[height:].reshape(2, height // 2, width // 2)
    if settings.denoise:
        reach = _DEVIATION * _LUMA_SIGMA * noise
        luma = _denoised(luma, reach, settings.denoise)
        reach = _CHROMA_DEVIATION * _CHROMA_SIGMA * noise
        chroma = np.stack(
            [_denoised(plane, reach, _CHROMA_SHARE * settings.denoise) for plane in chroma]
        )
    if settings.sharpen:
        luma = _sharpened(luma, settings.sharpen)
    planes = [luma, chroma[0], chroma[1]]
    if settings.jpeg:
        planes = [_compressed(plane, settings.jpeg) for plane in planes]
    return np.concatenate([plane.ravel() for plane in planes]).reshape(image.shape)


def _denoised(plane: Bytes, reach: float, share: float) -> Bytes:
    """A plane mixed with its bilateral mean; reach is the noise's range, grey levels."""
    mean = cv2.bilateralFilter(np.ascontiguousarray(plane), _WINDOW, max(reach, 0.1), _WINDOW_SIGMA)
    return np.asarray(cv2.addWeighted(mean, share, plane, 1.0 - share, 0.0), np.uint8)


def _compressed(plane: Bytes, quality: int) -> Bytes:
    """A plane after JPEG of that quality and back."""
    coded = cv2.imencode(".jpg", plane, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), np.uint8)


def _sharpened(luma: Bytes, strength: float) -> Bytes:
    """A plane with its details made stronger."""
    root = math.sqrt(strength)
    level = luma.astype(np.float32)
    detail = level - cv2.GaussianBlur(level, (0, 0), _BLUR_PX)
    size = np.maximum(np.abs(detail) - _THRESHOLD / root, 0.0)
    added = np.minimum(_GAIN * strength * size, _LIMIT * root) * np.sign(detail)
    return np.clip(np.rint(level + added), 0, 255).astype(np.uint8)
