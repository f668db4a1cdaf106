"""Bench measurements: the paper's distances, and tables read from files."""

from __future__ import annotations

import pytest

from rhot.errors import CalibrationError
from services.calibrator.depth_law.bench import PAPER_DISTANCES_CM, read_bench


def test_the_bench_is_the_papers():
    assert PAPER_DISTANCES_CM[0] == 100.0
    assert PAPER_DISTANCES_CM[-1] == 20.0
    assert len(PAPER_DISTANCES_CM) == 17


def test_a_table_is_read(tmp_path):
    path = tmp_path / "bench.csv"
    path.write_text("distance_cm,disparity_px\n100,39.5\n\n20, 198\n")
    distances, disparities = read_bench(path)
    assert distances.tolist() == [100.0, 20.0]
    assert disparities.tolist() == [39.5, 198.0]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "line 1: expected the header"),
        ("cm,px\n1,2\n", "line 1: expected the header"),
        ("distance_cm,disparity_px\n100,39\n50\n", "line 3: expected two numbers"),
        ("distance_cm,disparity_px\n100,nan\n", "line 2: distance and disparity must be positive"),
        ("distance_cm,disparity_px\n-5,39\n", "line 2: distance and disparity must be positive"),
    ],
)
def test_a_bad_table_is_refused_with_its_line(tmp_path, text, reason):
    path = tmp_path / "bench.csv"
    path.write_text(text)
    with pytest.raises(CalibrationError, match=reason):
        read_bench(path)


def test_a_missing_table_is_named(tmp_path):
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_bench(tmp_path / "none.csv")
