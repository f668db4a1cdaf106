"""`rhot calibrate depth` as a user types it."""

from __future__ import annotations

import json

import pytest

from rhot.errors import CalibrationError


def test_depth_fits_a_table_or_the_simulated_bench(run_calibrate, tmp_path):
    result = run_calibrate("depth", "--simulate", "--divergence-deg", 0.095, "--zero-mm", 10.2)
    assert "RHOT eq. (9)" in result.stdout
    law = json.loads(run_calibrate("depth", "--simulate", "--json").stdout)
    table = tmp_path / "bench.csv"
    rows = zip(law["distances_cm"], law["disparities_px"], strict=True)
    lines = [f"{distance},{disparity}\n" for distance, disparity in rows]
    table.write_text("distance_cm,disparity_px\n" + "".join(lines))
    fitted = json.loads(run_calibrate("depth", table, "--json").stdout)
    assert fitted["k"] == pytest.approx(law["k"])
    with pytest.raises(CalibrationError, match="--simulate"):
        run_calibrate("depth")
