"""Pictures and board positions that contradict the others, by their residuals. Pure."""

from __future__ import annotations

import numpy as np

# Rounds of adjusting and leaving out outliers; each round may show others that the worst ones hid.
OUTLIER_ROUNDS = 4
# An outlier's RMS residual is this many times the median one, and more than _OFF_PX at 640 px
# width.
_OFF_TIMES, _OFF_PX = 4.0, 0.6
# More than this share are never left out: then the median is not to be trusted either.
_OFF_SHARE = 0.34


def outliers(rms_px: list[float], width_px: int) -> list[int]:
    """Which of these RMS residuals (px, pictures of this width) are far above the median.

    None if there are too many of them.
    """
    limit = max(_OFF_TIMES * float(np.median(rms_px)), _OFF_PX * width_px / 640.0)
    # Not `error > limit`: with a NaN among them no limit is known, and all are too many.
    far = [k for k, error in enumerate(rms_px) if not error <= limit]
    return far if len(far) <= _OFF_SHARE * len(rms_px) else []
