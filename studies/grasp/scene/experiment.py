"""One subject's experiment: from its options and a seed to each picture and to the truth."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

from rhot.geometry.transforms import Array
from studies.grasp.scene.backdrop import Rectangle, backdrop, mm_per_px
from studies.grasp.scene.flesh import Pixels
from studies.grasp.scene.hand import BASE_DOT, THUMB_BASE, Layer, Look, layers
from studies.grasp.scene.motion import Cycles, perform
from studies.grasp.scene.skin import Light, blurred
from studies.grasp.scene.subjects import Subject, chain
from studies.grasp.scene.view import Picture, ViewOptions, place_camera

DOT_COLOURS = {
    "black": (0.07, 0.06, 0.06),
    "blue": (0.72, 0.30, 0.12),
    "green": (0.25, 0.60, 0.14),
    "red": (0.16, 0.12, 0.72),
    "white": (0.93, 0.93, 0.93),
}
INDEX_JOINTS = ("mcp", "pip", "dip", "tip")
THUMB_JOINTS = ("thumb_cmc", "thumb_mp", "thumb_ip", "thumb_tip")
# Where the MCP joint of a hand is that is not shifted, mm in the plane.
_MCP_MM = (-12.0, -4.0)
# The shadow on the wall: how far it falls (mm), how dark it is, how soft (mm).
_SHADOW_MM, _SHADOW_DEPTH, _SHADOW_SOFT_MM = (11.0, 13.0), 0.32, 5.0


class Options(NamedTuple):
    """What is filmed. dots: a colour of DOT_COLOURS, or None for plain skin; thumb: its tip meets
    the index finger's, and it has four dots, too (then the base line has none); mirrored: the hand
    comes from the right. noise: RMS in grey levels; focus: blur of lens and demosaicing in px.
    """

    view: ViewOptions = ViewOptions()
    cycles: Cycles = Cycles()
    rectangle: Rectangle = Rectangle()
    dots: str | None = "blue"
    thumb: bool = False
    mirrored: bool = False
    noise: float = 2.5
    focus: float = 0.6
    light: Light = Light()


class Experiment:
    """Pictures and truth of one subject. The same subject, options and seed give the same."""

    def __init__(self, subject: Subject, options: Options, seed: int = 0) -> None:
        self.subject, self.options, self.seed = subject, options, seed
        self.view = place_camera(options.view, seed)
        cycles = options.cycles._replace(pinch=options.thumb)
        self.motion = perform(subject, cycles, seed)
        self.look = Look(
            DOT_COLOURS[options.dots] if options.dots else None, options.thumb, options.light, seed
        )

    def __len__(self) -> int:
        return len(self.motion.time_s)

    def joints(self, frame: int) -> dict[str, Array]:
        """Joints in the finger's frame, (2,) mm each: index and thumb, and `base` on the back of
        the hand.
        """
        index = chain(self.subject.lengths, self.motion.angles[frame], (0.0, 0.0))
        thumb = chain(self.subject.thumb, self.motion.thumb[frame], THUMB_BASE)
        return {
            "base": np.asarray(BASE_DOT),
            **dict(zip(INDEX_JOINTS, index, strict=True)),
            **dict(zip(THUMB_JOINTS, thumb, strict=True)),
        }

    def pixels_of(self, frame: int) -> dict[str, Array]:
        """Where the joints are in the picture, lens included; (2,) px each."""
        joints = self.joints(frame)
        plane = np.stack(list(joints.values())) @ self._turned(frame).T + self._mcp(frame)
        return dict(zip(joints, self.view.pixels(plane), strict=True))

    def hand(self, frame: int) -> list[Layer]:
        """What is laid over the backdrop, from the back."""
        angles, thumb = self.motion.angles[frame], self.motion.thumb[frame]
        return list(layers(self.subject, angles, thumb, self._pixels(frame), self.look))

    def picture(self, frame: int) -> npt.NDArray[np.uint8]:
        """One picture (h, w, 3), blue, green, red."""
        hand = self.hand(frame)
        picture = self._backdrop * self._shadow(hand)
        for (rows, columns), colour, share in hand:
            part = picture[:, rows, columns]
            part += share * (colour - part)
        return self._developed(picture, frame)

    def _developed(self, picture: Picture, frame: int) -> npt.NDArray[np.uint8]:
        """Out of focus as lenses are, noisy as sensors are, 8 bits."""
        rng = np.random.default_rng((self.seed, 5, frame))
        height, width = picture.shape[1:]
        # Exposure control hunts a little.
        gain = np.float32(255.0 * (1.0 + 0.006 * np.sin(0.21 * frame + self.seed)))
        planes = []
        for plane, (row, column) in zip(
            picture, rng.integers(0, _NOISE_MARGIN, (3, 2)), strict=True
        ):
            if self.options.focus > 0.0:
                plane = blurred(plane, self.options.focus)
            noise = self._noise[row : row + height, column : column + width]
            # Photons: half of the noise grows with the light.
            level = plane * gain + noise * (np.float32(0.6) + np.float32(0.5) * plane)
            planes.append(cv2.convertScaleAbs(np.maximum(level, 0.0)))
        return np.asarray(cv2.merge(planes))

    def _turned(self, frame: int) -> Array:
        """Finger's frame to plane; (2, 2)."""
        c, s = np.cos(self.motion.turn[frame]), np.sin(self.motion.turn[frame])
        side = -1.0 if self.options.mirrored else 1.0
        return np.array([[side, 0.0], [0.0, 1.0]]) @ np.array([[c, -s], [s, c]])

    def _mcp(self, frame: int) -> Array:
        """The MCP joint in the plane; (2,) mm."""
        x, y = _MCP_MM
        start = np.array([-x if self.options.mirrored else x, y])
        return start + self.motion.shift[frame]

    def _pixels(self, frame: int) -> Pixels:
        turned, mcp = self._turned(frame), self._mcp(frame)
        back = np.linalg.inv(turned).astype(np.float32)
        x, y = self._plane[..., 0] - np.float32(mcp[0]), self._plane[..., 1] - np.float32(mcp[1])
        return Pixels(
            back[0, 0] * x + back[0, 1] * y,
            back[1, 0] * x + back[1, 1] * y,
            self._mm_per_px,
            lambda points: self.view.pixels(points @ turned.T + mcp),
        )

    def _shadow(self, hand: list[Layer]) -> Picture:
        """How much light is left on the wall; (h, w)."""
        height, width = self._mm_per_px.shape
        # Soft shadows need no more than every fourth pixel.
        small = np.zeros((-(-height // 4), -(-width // 4)), dtype=np.float32)
        for (rows, columns), _, share in hand:
            top, left = -(-rows.start // 4), -(-columns.start // 4)
            part = share[4 * top - rows.start :: 4, 4 * left - columns.start :: 4]
            target = small[top : top + part.shape[0], left : left + part.shape[1]]
            np.maximum(target, part[: target.shape[0], : target.shape[1]], out=target)
        per_px = 4.0 * float(np.median(self._mm_per_px[::16, ::16]))
        move = np.array([[1.0, 0.0, _SHADOW_MM[0] / per_px], [0.0, 1.0, _SHADOW_MM[1] / per_px]])
        moved = cv2.warpAffine(small, move, (small.shape[1], small.shape[0]))
        soft = cv2.GaussianBlur(moved, (0, 0), _SHADOW_SOFT_MM / per_px)
        whole = cv2.resize(soft, (width, height), interpolation=cv2.INTER_LINEAR)
        return np.float32(1.0) - np.float32(_SHADOW_DEPTH) * whole

    @cached_property
    def _plane(self) -> Picture:
        return self.view.plane(self._directions)

    @cached_property
    def _directions(self) -> Array:
        return self.view.directions()

    @cached_property
    def _mm_per_px(self) -> Picture:
        return mm_per_px(self._plane)

    @cached_property
    def _backdrop(self) -> Picture:
        return backdrop(self.view, self._directions, self.options.rectangle, self.seed)

    @cached_property
    def _noise(self) -> Picture:
        """A sheet of noise, larger than a picture: each colour takes another part of it."""
        width, height = self.view.camera.size_px
        rng = np.random.default_rng((self.seed, 6))
        sheet = rng.standard_normal(
            (height + _NOISE_MARGIN, width + _NOISE_MARGIN), dtype=np.float32
        )
        # Demosaicing spreads noise over neighbours; the RMS stays.
        sheet = blurred(sheet, 0.6)
        return sheet * np.float32(self.options.noise / sheet.std())


# By how much the sheet is larger than a picture, px.
_NOISE_MARGIN = 96
