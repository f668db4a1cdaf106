"""Do the pictures show the board everywhere in the image, and tilted? What a person must do next to
make them. Pure.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot.geometry.transforms import Array

# Cells of the picture that corners should fall into: fine enough to see an empty border, coarse
# enough for 54 corners.
_COLS, _ROWS = 8, 6


@dataclass(frozen=True)
class Coverage:
    """counts[row][col]: corners in each cell of the picture; tilt_deg: by picture, the board's
    angle to the image plane.

    normals_deg is how far the board normals are apart, at most: what separates focal length from
    distance.
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
        """Where corners are missing, in words: `top left, right`; empty if nowhere worth a word."""
        empty = np.array(self.counts) == 0
        thirds = {"top": slice(0, 2), "middle": slice(2, 4), "bottom": slice(4, 6)}
        sides = {"left": slice(0, 3), "centre": slice(3, 5), "right": slice(5, 8)}
        words = [
            {"middle centre": "centre"}.get(f"{row} {col}", f"{row} {col}")
            for row, rows in thirds.items()
            for col, cols in sides.items()
            if np.all(empty[rows, cols])
        ]
        return ", ".join(words)

    def drawing(self) -> str:
        """The cells as text, by how many corners they hold: `.` none, `-` up to 5, `+` up to 20,
        `#` more.
        """
        signs = [(0, "."), (5, "-"), (20, "+"), (10**9, "#")]
        return "\n".join(
            " ".join(next(sign for most, sign in signs if count <= most) for count in row)
            for row in self.counts
        )


def coverage(
    size_px: tuple[int, int], corners: list[Array], T_camera_from_board: list[Array]
) -> Coverage:
    """Coverage of a picture by the corners (n, 2) of each view, and the tilts of its boards (4, 4)."""
    counts = np.zeros((_ROWS, _COLS), dtype=np.int64)
    for points in corners:
        col = np.clip((points[:, 0] + 0.5) * _COLS / size_px[0], 0, _COLS - 1).astype(np.int64)
        row = np.clip((points[:, 1] + 0.5) * _ROWS / size_px[1], 0, _ROWS - 1).astype(np.int64)
        np.add.at(counts, (row, col), 1)
    normals = np.array([T[:3, 2] * np.sign(T[2, 2] or 1.0) for T in T_camera_from_board]).reshape(
        -1, 3
    )
    tilts = np.degrees(np.arccos(np.clip(normals[:, 2], -1.0, 1.0)))
    apart = (
        np.degrees(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0))).max()
        if len(normals)
        else 0.0
    )
    return Coverage(
        tuple(tuple(int(c) for c in row) for row in counts),
        tuple(float(t) for t in tilts),
        float(apart),
    )
