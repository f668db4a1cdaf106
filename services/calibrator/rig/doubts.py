"""Rigs that look like a slip: metres, centimetres and millimetres mixed up. Pure.

A calibration cannot tell its own scale, so where the cameras and the board would have been is
compared with how people build rigs and hold boards, and a person is asked where it differs.
"""

from __future__ import annotations

from services.calibrator.board.board import length_text, range_text

# Cameras of one rig: nearer than this they would touch, farther apart they see no hand together.
_BASELINE_M = (0.02, 2.0)
# Distances at which a board is held before a camera: nearer it is out of focus; and a board that
# fills a sixth of the picture at 4 m is no longer one that is held.
_DISTANCE_M = (0.05, 4.0)


def rig_doubts(
    square_m: float, baselines_m: dict[str, float], distance_m: float, focal_px: float
) -> list[str]:
    """What is unusual about cameras so far from the first one, by name, and a board so far away.

    square_m is 1 where lengths have no unit: then nothing is.
    """
    if square_m == 1.0:
        return []
    found = [
        f"camera {name!r} would stand {length_text(baseline_m)} from the first one (usual are "
        f"{range_text(_BASELINE_M)})"
        for name, baseline_m in baselines_m.items()
        if not _BASELINE_M[0] <= baseline_m <= _BASELINE_M[1]
    ]
    if not _DISTANCE_M[0] <= distance_m <= _DISTANCE_M[1]:
        found.append(
            f"the board would have been {length_text(distance_m)} away (usual are "
            f"{range_text(_DISTANCE_M)}), since squares of {length_text(square_m)} look "
            f"{focal_px * square_m / distance_m:.0f} px wide at a focal length of "
            f"{focal_px:.0f} px"
        )
    if found:
        found[-1] += (
            f"; is the side of the squares {length_text(square_m)}? --square is in metres, and "
            "all lengths scale with it"
        )
    return found
