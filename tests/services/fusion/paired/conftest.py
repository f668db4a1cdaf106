"""A synthetic recording for the tests of filters: a still hand, then a fast one."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from rhot.messages import HandPoint, HandPoints
from testing.synthetic_points import START_NS, MovingHand


def _recording(
    still_s: float,
    fast_s: float,
    speed_m_s: float = 0.5,
    noise_m: float = 1e-3,
    source="measured",
) -> Iterator[HandPoints]:
    random, path = np.random.default_rng(0), MovingHand(speed_m_s=speed_m_s)
    for k in range(int(30 * (still_s + fast_s))):
        at_s = max(0.0, k / 30.0 - still_s)
        points = [
            HandPoint(
                name=name,
                position_m=tuple((p + random.normal(0.0, noise_m, 3)).tolist()),
                sigma_m=(1e-3,) * 3,
                cameras=[],
                source=source,
            )
            for name, p in zip(("wrist", "index_tip"), path(np.array([at_s]))[0], strict=False)
        ]
        yield HandPoints(
            hand="right", seq=k, stamp_ns=START_NS + round(k * 1e9 / 30.0), points=points
        )


@pytest.fixture(scope="session")
def recording() -> Callable[..., Iterator[HandPoints]]:
    """Two landmarks at 30 fps with noise: still_s at rest, then fast_s in motion."""
    return _recording
