"""Coverage: whether pictures show the board all over the image, and tilted. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array

# Cells of the picture that corners should fall into: fine enough to see an empty border, coarse
# enough for 54 corners.
_COLS, _ROWS = 8, 6
# The cells that make up each part of the picture that has a name.
_PARTS_DOWN = {"top": slice(0, 2), "middle": slice(2, 4), "bottom": slice(4, 6)}
_PARTS_ACROSS = {"left": slice(0, 3), "centre": slice(3, 5), "right": slice(5, 8)}
# Signs of the drawing, each with the most corners a cell of that sign holds.
_SIGNS = ((0, "."), (5, "-"), (20, "+"), (10**9, "#"))


@dataclass(frozen=True)
class Coverage:
    """Where the corners of all pictures lie in the image, and how the boards were tilted.

    counts[row][col] are the corners in each cell. tilt_deg is, by picture, the angle of the board
    to the image plane. normals_deg is the largest angle between two board normals: it separates
    focal length from distance.
    """

    counts: tuple[tuple[int, ...], ...]
    tilt_deg: tuple[float, ...]
    normals_deg: float

    @property
    def share(self) -> float:
        """Share of the cells that hold a corner, 0..1."""
        cells = np.array(self.counts)
        return float(np.count_nonzero(cells)) / cells.size

    @property
    def missing(self) -> str:
        """Parts of the picture without a corner, in words: `top left, middle right`, or empty."""
        empty = np.array(self.counts) == 0
        names = [
            f"{down} {across}"
            for down, rows in _PARTS_DOWN.items()
            for across, cols in _PARTS_ACROSS.items()
            if np.all(empty[rows, cols])
        ]
        return ", ".join("centre" if name == "middle centre" else name for name in names)

    def drawing(self) -> str:
        """The cells as text, by their corners: `.` none, `-` up to 5, `+` up to 20, `#` more."""
        return "\n".join(" ".join(_sign(count) for count in row) for row in self.counts)


def _sign(count: int) -> str:
    return next(sign for most, sign in _SIGNS if count <= most)


def coverage(
    size_px: tuple[int, int], corners: list[Array], T_camera_from_board: list[Array]
) -> Coverage:
    """Coverage of a picture (width, height) by the corners (n, 2) and board poses of its views."""
    counts = np.zeros((_ROWS, _COLS), dtype=np.int64)
    for points in corners:
        col = np.clip((points[:, 0] + 0.5) * _COLS / size_px[0], 0, _COLS - 1).astype(np.int64)
        row = np.clip((points[:, 1] + 0.5) * _ROWS / size_px[1], 0, _ROWS - 1).astype(np.int64)
        np.add.at(counts, (row, col), 1)
    # The side of the board that faces the camera does not matter: normals point away from it.
    normals = np.array([T[:3, 2] * np.sign(T[2, 2] or 1.0) for T in T_camera_from_board])
    normals = normals.reshape(-1, 3)
    tilts = np.degrees(np.arccos(np.clip(normals[:, 2], -1.0, 1.0)))
    between = np.degrees(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0)))  # (v, v)
    return Coverage(
        counts=tuple(tuple(int(count) for count in row) for row in counts),
        tilt_deg=tuple(float(tilt) for tilt in tilts),
        normals_deg=float(between.max()) if len(normals) else 0.0,
    )
