"""What stands behind the hand: a desk and a wall with texture, straight edges, a card with the
reference rectangle. Drawn once for a view.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rhot.geometry.transforms import Array
from studies.grasp.scene.skin import cover, textured
from studies.grasp.scene.view import Picture, View

# The wall's plane and the desk's edge in it (mm); the finger is nearer to the camera.
WALL_Z_MM, _DESK_Y_MM = 45.0, 98.0
_WALL, _DESK, _CARD, _INK = (
    (0.62, 0.66, 0.66),
    (0.30, 0.40, 0.50),
    (0.88, 0.90, 0.90),
    (0.30, 0.24, 0.22),
)


class Rectangle(NamedTuple):
    """The reference: its first corner (left, upper), size in mm, and its plane's z, 0 for the
    finger's own.
    """

    corner: tuple[float, float] = (16.0, -66.0)
    size: tuple[float, float] = (80.0, 36.0)
    z: float = 0.0

    @property
    def corners(self) -> Array:
        """(4, 2) mm: upper left, upper right, lower right, lower left."""
        (x, y), (w, h) = self.corner, self.size
        return np.array([(x, y), (x + w, y), (x + w, y + h), (x, y + h)])


def backdrop(view: View, directions: Array, rectangle: Rectangle, seed: int) -> Picture:
    """The picture without a hand; (3, h, w), 0..1. directions as the view has them."""
    wall = view.plane(directions, WALL_Z_MM)
    x, y = wall[..., 0], wall[..., 1]
    scale = mm_per_px(wall)
    rng = np.random.default_rng((seed, 4))
    picture = _surface(x, y, _WALL, 0.035, 1.2, seed, 11)
    # Stripes of a wallpaper or tiles: straight edges that are no finger.
    for at in np.arange(-160.0, 170.0, 34.0) + rng.uniform(0.0, 30.0):
        _blend(picture, cover(np.abs(x - np.float32(at)) - 0.8, scale), (0.52, 0.57, 0.58))
    desk = _surface(x, y * 0.25, _DESK, 0.09, 1.6, seed, 12)
    _blend(picture, cover(_DESK_Y_MM - y, scale), desk)
    _blend(picture, cover(np.abs(y - _DESK_Y_MM) - 1.0, scale), (0.16, 0.2, 0.25))
    _cable(picture, x, y, scale, rng)
    _card(picture, view.plane(directions, rectangle.z), rectangle, seed)
    # A lamp to one side, and a lens that is darker at its edge.
    height, width = picture.shape[1:]
    across = np.linspace(-1.0, 1.0, width, dtype=np.float32)
    down = np.linspace(-1.0, 1.0, height, dtype=np.float32)[:, None]
    return picture * (1.0 - np.float32(0.10) * across - np.float32(0.08) * down)


def straight_lines(view: View, rectangle: Rectangle, seed: int) -> list[Array]:
    """Pixels along edges that are straight in the world, 25 of each: what a lens bends."""
    rng = np.random.default_rng((seed, 4))
    stripes = np.arange(-160.0, 170.0, 34.0) + rng.uniform(0.0, 30.0)
    share = np.linspace(0.0, 1.0, 25)[:, None]
    ends = [(((at, -110.0), (at, _DESK_Y_MM)), WALL_Z_MM) for at in stripes]
    ends.append((((-160.0, _DESK_Y_MM), (160.0, _DESK_Y_MM)), WALL_Z_MM))
    corners = rectangle.corners
    for number in range(4):
        pair = (tuple(corners[number]), tuple(corners[(number + 1) % 4]))
        ends.append((pair, rectangle.z))
    lines = []
    width, height = view.camera.size_px
    for (first, last), z in ends:
        pixels = view.pixels(np.asarray(first) * (1.0 - share) + np.asarray(last) * share, z)
        inside = ((pixels >= 0) & (pixels <= (width - 1, height - 1))).all(axis=1)
        if inside.sum() >= 8:
            lines.append(pixels[inside])
    return lines


def mm_per_px(plane: Picture) -> Picture:
    """How large a pixel is in a plane; (h, w)."""
    across = np.gradient(plane, axis=1)
    down = np.gradient(plane, axis=0)
    area = np.abs(across[..., 0] * down[..., 1] - across[..., 1] * down[..., 0])
    return np.sqrt(area).astype(np.float32)


def _surface(
    x: Picture,
    y: Picture,
    colour: tuple[float, ...],
    depth: float,
    per_mm: float,
    seed: int,
    kind: int,
) -> Picture:
    level = 1.0 + np.float32(depth) * textured(x, y, per_mm, seed, kind)
    return _planes(colour) * level


def _blend(picture: Picture, share: Picture, colour: Picture | tuple[float, ...]) -> None:
    """Lays a colour over the picture, in place."""
    over = colour if isinstance(colour, np.ndarray) else _planes(colour)
    picture += share * (over - picture)


def _planes(colour: tuple[float, ...]) -> Picture:
    return np.asarray(colour, dtype=np.float32)[:, None, None]


def _cable(
    picture: Picture, x: Picture, y: Picture, scale: Picture, rng: np.random.Generator
) -> None:
    """Something thin and curved that hangs about."""
    middle = rng.uniform(70.0, 110.0)
    distance = np.abs(x - middle - 9.0 * np.sin(y / 21.0 + 1.0).astype(np.float32)) - 1.4
    _blend(picture, cover(distance, scale), (0.18, 0.18, 0.2))


def _card(picture: Picture, plane: Picture, rectangle: Rectangle, seed: int) -> None:
    """A white card, printed with the rectangle."""
    x, y, scale = plane[..., 0], plane[..., 1], mm_per_px(plane)
    (left, upper), (width, height) = rectangle.corner, rectangle.size
    dx = np.abs(x - (left + 0.5 * width)) - 0.5 * width
    dy = np.abs(y - (upper + 0.5 * height)) - 0.5 * height
    distance = np.maximum(dx, dy).astype(np.float32)
    _blend(picture, cover(distance - 7.0, scale), _surface(x, y, _CARD, 0.012, 2.0, seed, 13))
    _blend(picture, cover(distance, scale), _surface(x, y, _INK, 0.03, 2.0, seed, 14))
    # A printed rectangle is a frame about a paler field.
    _blend(picture, cover(distance + 4.0, scale), _surface(x, y, _WALL, 0.02, 2.0, seed, 15))
