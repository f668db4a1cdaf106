"""Paint of which no pose has told anything yet."""

from __future__ import annotations

from typing import Any

import numpy as np

from services.fusion.paint.known_paint import LONG_AGO_NS, KnownPaint

_SHIFTS = 61


def untold_paint(count: int, **known: Any) -> KnownPaint:
    """Of count landmarks of one hand; known: parts of KnownPaint that are not as at first."""
    at_first = KnownPaint(
        radii_m=np.zeros(count),
        sags_m=np.zeros(count),
        shifts_m=np.zeros((count, _SHIFTS)),
        areas_m2=np.zeros((count, _SHIFTS)),
        radius_sds=np.zeros(count),
        directions=np.zeros((count, 3)),
        hinges=np.zeros((count, 3)),
        direction_sigmas=np.zeros((count, 2)),
        misfits=np.ones(count),
        direction_shares=np.ones(count),
        shape_sds=np.zeros(count),
        hands=np.zeros(count, dtype=np.int64),
        turns_rad_s=np.zeros((count, 3)),
        stamps_ns=np.full(count, LONG_AGO_NS),
        viewpoint_rig=np.zeros(3),
    )
    return at_first._replace(**known)
