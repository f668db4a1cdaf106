"""How capsules and dabs move, in the camera and in its picture, while one frame is exposed.
Compiled kernels. Pure.

A path is a parabola in u: u = -1 is the first instant that any row is exposed, u = 1 the last. Over
the 24 ms of a frame a waving hand leaves it by less than 0.1 mm.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from services.simulator.render.ray_capsule import FAR, project

# Room for the error of the parabola in the image, px.
_MARGIN_PX = 1.5


@njit(cache=True, nogil=True, error_model="numpy")
def parabola(at_start, at_middle, at_end, out):  # type: ignore[no-untyped-def]
    """Coefficients out (3, n) of the parabola in u through three instants (n,)."""
    for i in range(out.shape[1]):
        out[0, i] = at_middle[i]
        out[1, i] = 0.5 * (at_end[i] - at_start[i])
        out[2, i] = 0.5 * (at_start[i] + at_end[i]) - at_middle[i]


@njit(cache=True, nogil=True, error_model="numpy")
def _point(positions, rotations, frame, offset, R, p, out):  # type: ignore[no-untyped-def]
    """A point fixed to a frame, in camera coordinates."""
    x = np.empty(3)
    for i in range(3):
        x[i] = positions[frame, i]
        for j in range(3):
            x[i] += rotations[frame, i, j] * offset[j]
    for i in range(3):
        out[i] = p[i] + R[i, 0] * x[0] + R[i, 1] * x[1] + R[i, 2] * x[2]


@njit(cache=True, nogil=True, error_model="numpy")
def motions(positions, rotations, R, p, lens, frame, offset, radius, ends, palms, tracks):  # type: ignore[no-untyped-def]
    """Parabolas of all capsules from the frames at three instants, positions (3, f, 3), rotations
    (3, f, 3, 3).

    ends (c, 2, 3, 3): each end's path in the camera frame; palms (c, 3, 3): path of the direction
    that is palmar for the capsule's first frame; tracks (c, 2, 3, 3): each end's path in the image:
    x, y, radius in px.
    """
    at, image, direction = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for c in range(frame.shape[0]):
        for end in range(2):
            for k in range(3):
                _point(positions[k], rotations[k], frame[c, end], offset[c, end], R, p, at[k])
                near = at[k, 2] - radius[c, end]
                if near > 0.02:
                    image[k, 0], image[k, 1] = project(lens, at[k, 0], at[k, 1], at[k, 2])
                    image[k, 2] = 1.08 * lens[0] * radius[c, end] / near
                else:
                    # Too near to be drawn.
                    image[k, 0], image[k, 1], image[k, 2] = FAR, FAR, 0.0
            parabola(at[0], at[1], at[2], ends[c, end])
            parabola(image[0], image[1], image[2], tracks[c, end])
        for k in range(3):
            for i in range(3):
                f = frame[c, 0]
                direction[k, i] = -(
                    R[i, 0] * rotations[k, f, 0, 1]
                    + R[i, 1] * rotations[k, f, 1, 1]
                    + R[i, 2] * rotations[k, f, 2, 1]
                )
        parabola(direction[0], direction[1], direction[2], palms[c])


@njit(cache=True, nogil=True, error_model="numpy")
def points(positions, rotations, R, p, frame, offset, paths):  # type: ignore[no-untyped-def]
    """Parabolas (d, 3, 3) of points fixed to frames."""
    at = np.empty((3, 3))
    for d in range(frame.shape[0]):
        for k in range(3):
            _point(positions[k], rotations[k], frame[d], offset[d], R, p, at[k])
        parabola(at[0], at[1], at[2], paths[d])


@njit(cache=True, nogil=True, error_model="numpy")
def rows_of(tracks, height, spans):  # type: ignore[no-untyped-def]
    """First and last row (c, 2) that each capsule can touch at any instant.

    An empty span for what is too near.
    """
    for c in range(tracks.shape[0]):
        low, high = FAR, -FAR
        for end in range(2):
            for k in range(3):
                u = k - 1.0
                y = tracks[c, end, 0, 1] + u * (tracks[c, end, 1, 1] + u * tracks[c, end, 2, 1])
                r = (
                    tracks[c, end, 0, 2]
                    + u * (tracks[c, end, 1, 2] + u * tracks[c, end, 2, 2])
                    + _MARGIN_PX
                )
                low, high = min(low, y - r), max(high, y + r)
        if high - low > 10.0 * height:
            low, high = FAR, -FAR
        spans[c, 0] = int(max(0.0, min(low, height)))
        spans[c, 1] = int(max(-1.0, min(high + 1.0, height - 1.0)))


@njit(cache=True, nogil=True, error_model="numpy")
def columns_of(track, u, row, width):  # type: ignore[no-untyped-def]
    """First and last column where a capsule can touch a row at instant u; (0, -1) if nowhere."""
    ax = track[0, 0, 0] + u * (track[0, 1, 0] + u * track[0, 2, 0])
    ay = track[0, 0, 1] + u * (track[0, 1, 1] + u * track[0, 2, 1])
    ar = track[0, 0, 2] + u * (track[0, 1, 2] + u * track[0, 2, 2])
    bx = track[1, 0, 0] + u * (track[1, 1, 0] + u * track[1, 2, 0])
    by = track[1, 0, 1] + u * (track[1, 1, 1] + u * track[1, 2, 1])
    br = track[1, 0, 2] + u * (track[1, 1, 2] + u * track[1, 2, 2])
    r = max(ar, br) + _MARGIN_PX
    # The stretch of the axis that comes within r of the row.
    s0, s1 = 0.0, 1.0
    dy = by - ay
    if abs(dy) > 1e-9:
        p, q = (row - r - ay) / dy, (row + r - ay) / dy
        s0, s1 = max(0.0, min(p, q)), min(1.0, max(p, q))
    elif abs(row - ay) > r:
        return 0, -1
    if s0 > s1:
        return 0, -1
    x0, x1 = ax + s0 * (bx - ax), ax + s1 * (bx - ax)
    low, high = min(x0, x1) - r, max(x0, x1) + r
    return int(max(0.0, min(low, width))), int(max(-1.0, min(high + 1.0, width - 1.0)))
