"""Rigs ten times too large or too small."""

from __future__ import annotations

from services.calibrator.rig.doubts import rig_doubts


def test_baselines_and_distances_ten_times_off_are_doubts():
    assert rig_doubts(0.025, {"right": 0.0647, "third": 1.2}, 0.4, 530.0) == []
    (doubt,) = rig_doubts(0.08, {"right": 2.07}, 1.3, 530.0)
    assert "camera 'right' would stand 2.07 m from the first one (usual are 20 mm to 2 m)" in doubt
    near, far = rig_doubts(0.006, {"right": 0.016}, 0.03, 530.0), rig_doubts(0.09, {}, 5.2, 530.0)
    assert "would stand 16 mm" in near[0]
    assert "would have been 30 mm away" in near[1]
    assert "look 9 px wide at a focal length of 530 px" in far[0]


def test_lengths_without_a_unit_are_no_doubt():
    assert rig_doubts(1.0, {"right": 3.3}, 15.0, 530.0) == []
