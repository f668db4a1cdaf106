"""Objects made from the truth have the error that was put into them; beginnings count once."""

from __future__ import annotations

import pytest

from rhot.messages.objects import Contact, Grasp, HandPart, ObjectContacts, ObjectPose
from rhot.messages.simulator import ObjectTruth, Truth
from services.cli.demo.metrics import DemoMetrics
from services.cli.demo.object_metrics import object_text
from services.cli.demo.summary import summary_text
from testing.sample_hands import object_pose

START_NS, FRAME_NS = 1_700_000_000_000_000_000, 33_333_333
IDENTITY = (1.0, 0.0, 0.0, 0.0)


def truth(index: int) -> Truth:
    cup = ObjectTruth(position_m=(0.01 * index, 0.0, 0.5), orientation_wxyz=IDENTITY)
    return Truth(stamp_ns=START_NS + index * FRAME_NS, hands={}, objects={"cup": cup})


def pose(index: float, **fields: object) -> ObjectPose:
    where = {
        "stamp_ns": START_NS + round(index * FRAME_NS),
        "position_m": (0.01 * index, 0.002, 0.5),
    }
    return object_pose(**(where | fields))


def contacts(seq: int, since: dict[HandPart, int], held_ns: int = 0) -> ObjectContacts:
    touching = [
        Contact(
            hand="right",
            part=part,
            distance_m=0.0,
            sigma_m=0.001,
            point_m=(0.0, 0.0, 0.5),
            touching=since_ns > 0,
            since_ns=since_ns,
        )
        for part, since_ns in since.items()
    ]
    grasps = [Grasp(hand="right", parts=["thumb"], since_ns=held_ns)] if held_ns else []
    return ObjectContacts(object="cup", seq=seq, stamp_ns=seq, contacts=touching, grasps=grasps)


@pytest.fixture
def metrics() -> DemoMetrics:
    return DemoMetrics()


def test_the_error_is_at_the_poses_own_instant(metrics: DemoMetrics) -> None:
    for index in range(10):
        metrics.objects.add_pose(pose(index + 0.5))
        metrics.add_truth(truth(index))
    # Nobody knows where it is without registration, nor while its tracker does not.
    metrics.objects.add_pose(pose(3.5, tracking="out_of_range", position_m=(9.0, 0.0, 0.0)))
    metrics.objects.add_pose(pose(4.5, registered=False, position_m=(9.0, 0.0, 0.0)))
    cup = metrics.summary({}).objects["cup"]
    assert (cup.poses, cup.ok_share) == (12, round(10 / 12, 4))
    assert cup.position_median_mm == cup.position_rms_mm == pytest.approx(2.0, abs=0.01)
    assert metrics.summary({}).object_poses == 12


def test_each_beginning_counts_once(metrics: DemoMetrics) -> None:
    metrics.objects.add_contacts(contacts(1, {"thumb": 5, "index": 0}))
    metrics.objects.add_contacts(contacts(2, {"thumb": 5, "index": 7}, held_ns=7))
    metrics.objects.add_contacts(contacts(3, {"thumb": 5, "index": 7}, held_ns=7))
    metrics.objects.add_contacts(contacts(4, {"thumb": 0, "index": 0}))
    metrics.objects.add_contacts(contacts(5, {"thumb": 9, "index": 0}, held_ns=11))
    cup = metrics.summary({}).objects["cup"]
    assert (cup.touches, cup.grasps) == (3, 2)


def test_the_summary_has_a_line_an_object(metrics: DemoMetrics) -> None:
    metrics.objects.add_pose(pose(0.0))
    (line,) = [line for line in summary_text(metrics.summary({})).splitlines() if "cup" in line]
    assert line.split() == ["cup", "1", "poses,", "100", "%", "ok"]
    metrics.add_truth(truth(0))
    metrics.objects.add_pose(pose(0.5))
    metrics.add_truth(truth(1))
    metrics.objects.add_contacts(contacts(1, {"thumb": 5}, held_ns=7))
    text = object_text("cup", metrics.summary({}).objects["cup"])
    assert "median 2.0 mm, RMS 2.0 mm against the truth; touched 1 times, held 1" in text


def test_names_from_the_network_are_bounded(metrics: DemoMetrics) -> None:
    for number in range(100):
        metrics.objects.add_pose(pose(0.0, object=f"o{number}"))
    assert len(metrics.summary({}).objects) == 16
