"""Outliers: far above the median, and never too many of them."""

from __future__ import annotations

import pytest

from services.calibrator.bundle.outliers import outliers


@pytest.mark.parametrize(
    ("rms_px", "found"),
    [
        ([0.2, 0.2, 0.2, 5.0], [3]),
        ([0.2, 0.2, float("nan"), 0.2], []),
        ([0.01, 0.01, 0.01, 0.5], []),
        ([0.2, 0.2, 5.0, 5.0], []),
    ],
    ids=["one far off", "NaN leaves no median", "far above the median, but small", "too many"],
)
def test_outliers(rms_px, found):
    assert outliers(rms_px, 640) == found
