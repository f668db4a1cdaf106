"""What is drawn of objects: positions, what was not ok, the errors beside the truth."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.messages.objects import ObjectPose
from rhot.messages.simulator import ObjectTruth, Truth

pytest.importorskip("matplotlib", reason="matplotlib is of the extra `study`")

from services.cli.plot.objects import drawings, objects_figure
from testing.sample_hands import object_pose

ORIGIN_NS = 1_700_000_000_000_000_000
IDENTITY = (1.0, 0.0, 0.0, 0.0)


def stamp(i: int) -> int:
    return ORIGIN_NS + i * 10_000_000


def pose(i: int, **fields: object) -> ObjectPose:
    where = {"seq": i, "stamp_ns": stamp(i), "position_m": (0.001 * i, 0.003, 0.5)}
    return object_pose(**(where | fields))


TRUTH = [
    Truth(
        stamp_ns=stamp(i),
        hands={},
        objects={"cup": ObjectTruth(position_m=(0.001 * i, 0.0, 0.5), orientation_wxyz=IDENTITY)},
    )
    for i in range(20)
]


def test_errors_are_those_of_poses_that_are_ok() -> None:
    poses = [pose(i, tracking="ok" if i % 2 else "out_of_range") for i in range(20)]
    poses += [pose(20, tracking="lost", position_m=(9.0, 9.0, 9.0)), pose(30)]
    drawn = drawings(poses[::-1], TRUTH, ORIGIN_NS)["cup"]
    assert np.nanmax(drawn.position.values) == pytest.approx(500.0)
    assert len(drawn.unsure.times_s) == 10
    assert drawn.off is not None
    np.testing.assert_allclose(drawn.off.times_s, [0.01 * i for i in range(1, 20, 2)], atol=1e-9)
    np.testing.assert_allclose(drawn.off.values[:, 0], 3.0, atol=1e-6)
    np.testing.assert_allclose(drawn.off.values[:, 1], 0.0, atol=1e-6)


def test_without_truth_or_without_registration_there_are_no_errors() -> None:
    poses = [pose(i) for i in range(20)]
    assert drawings(poses, [], ORIGIN_NS)["cup"].off is None
    unregistered = [pose(i, registered=False) for i in range(20)]
    drawn = drawings(unregistered, TRUTH, ORIGIN_NS)["cup"]
    assert (drawn.off, len(drawn.unsure.times_s)) == (None, 20)
    assert drawings([pose(0, tracking="lost")], TRUTH, ORIGIN_NS) == {}


def test_the_errors_have_axes_of_their_own() -> None:
    poses = [pose(i) for i in range(20)]
    assert len(objects_figure(drawings(poses, TRUTH, ORIGIN_NS)).axes) == 5
    assert len(objects_figure(drawings(poses, [], ORIGIN_NS)).axes) == 3
