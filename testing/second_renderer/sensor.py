"""From light to the bytes that a camera delivers: optics, Bayer mosaic, noise, tone, JPEG. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from testing.second_renderer.window import Bytes, Light32


@dataclass(frozen=True)
class Sensor:
    """How a camera turns light into a picture.

    gain: of all light; white: of red and blue against green; blur_px: the lens's; electrons: that
    white gives (noise is less the more there are); read: noise in the dark, electrons; sharpen:
    strength; jpeg: quality, 0: none.
    """

    gain: float = 1.0
    white: tuple[float, float] = (1.0, 1.0)
    blur_px: float = 0.6
    electrons: float = 2500.0
    read: float = 5.0
    sharpen: float = 0.0
    jpeg: int = 0


def developed(light: Light32, sensor: Sensor, seed: tuple[int, ...]) -> Bytes:
    """The picture (h, w, 3) of light (h, w, 3) as BGR bytes."""
    rng = np.random.default_rng(seed)
    gains = sensor.gain * np.array([sensor.white[0], 1.0, sensor.white[1]])
    soft = np.asarray(cv2.GaussianBlur(light, (0, 0), sensor.blur_px), dtype=np.float32)
    raw = _mosaic(soft * gains.astype(np.float32))
    electrons = sensor.electrons * np.clip(raw, 0.0, 1.0)
    noisy = electrons + rng.standard_normal(raw.shape, np.float32) * np.sqrt(
        electrons + sensor.read**2
    )
    codes = np.clip(4000.0 * noisy / sensor.electrons + 200.0, 0, 4200).astype(np.uint16)
    colors = np.asarray(cv2.cvtColor(codes, cv2.COLOR_BayerRGGB2BGR), dtype=np.float32)
    toned = _tone(np.clip((colors - 200.0) / 4000.0, 0.0, 1.0))
    if sensor.sharpen:
        toned += sensor.sharpen * (toned - np.asarray(cv2.GaussianBlur(toned, (0, 0), 1.2)))
    picture = np.clip(255.0 * toned + 0.5, 0, 255).astype(np.uint8)
    if sensor.jpeg:
        _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, sensor.jpeg])
        picture = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)
    return picture


def _mosaic(light: Light32) -> Light32:
    """One colour of each pixel: red, green / green, blue."""
    raw = light[..., 1].copy()
    raw[0::2, 0::2] = light[0::2, 0::2, 0]
    raw[1::2, 1::2] = light[1::2, 1::2, 2]
    return raw


def _tone(linear: Light32) -> Light32:
    """sRGB's curve with a soft shoulder."""
    bent = linear * (1.12 - 0.12 * linear)
    return np.where(
        bent <= 0.0031308, 12.92 * bent, 1.055 * np.maximum(bent, 1e-6) ** (1 / 2.4) - 0.055
    )


def as_i420(picture: Bytes) -> Bytes:
    """BGR (h, w, 3) as planes Y, U, V of limited range (h * 3 / 2, w), chroma the mean of four."""
    blue, green, red = (picture[..., k].astype(np.float32) for k in range(3))
    luma = 0.299 * red + 0.587 * green + 0.114 * blue
    y = 16.0 + luma * (219.0 / 255.0)
    u = 128.0 + (blue - luma) * (0.5 / 0.886) * (224.0 / 255.0)
    v = 128.0 + (red - luma) * (0.5 / 0.701) * (224.0 / 255.0)
    height, width = y.shape
    shape = (height // 2, 2, width // 2, 2)
    planes = [y.ravel(), *(part.reshape(shape).mean(axis=(1, 3)).ravel() for part in (u, v))]
    flat = np.clip(np.concatenate(planes) + 0.5, 0, 255).astype(np.uint8)
    return flat.reshape(height * 3 // 2, width)
