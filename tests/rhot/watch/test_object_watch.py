"""What an onlooker knows of objects: their state, what holds them, and bounds."""

from __future__ import annotations

from typing import Any

import pytest

from rhot.files.config import RigConfig
from rhot.files.rig_tables import ObjectTable
from rhot.messages.objects import Contact, Grasp, ObjectContacts, ObjectPose
from rhot.watch.object_watch import ObjectWatch
from rhot.watch.rig_monitor import RigMonitor

NOW_NS, SECOND_NS = 1_700_000_000_000_000_000, 1_000_000_000
CONFIG = RigConfig(object=[ObjectTable(name="cup", serial="LHR-1")])


def pose(name: str = "cup", **fields: Any) -> ObjectPose:
    values: dict[str, Any] = {
        "object": name,
        "serial": "LHR-1",
        "seq": 1,
        "stamp_ns": NOW_NS - 12_000_000,
        "position_m": (0.0, 0.0, 0.5),
        "orientation_wxyz": (1.0, 0.0, 0.0, 0.0),
        "velocity_m_s": (0.0, 0.0, 0.0),
        "angular_velocity_rad_s": (0.0, 0.0, 0.0),
        "tracking": "ok",
        "registered": True,
        "sigma_m": 0.0008,
    }
    return ObjectPose(**(values | fields))


def contacts(name: str = "cup") -> ObjectContacts:
    touching = [
        Contact(
            hand="right",
            part=part,  # type: ignore[arg-type]
            distance_m=0.0,
            sigma_m=0.001,
            point_m=(0.0, 0.0, 0.5),
            touching=part != "ring",
        )
        for part in ("thumb", "index", "ring")
    ]
    grasp = Grasp(hand="right", parts=["thumb", "index"], since_ns=NOW_NS)
    return ObjectContacts(object=name, seq=1, stamp_ns=NOW_NS, contacts=touching, grasps=[grasp])


@pytest.fixture
def watch() -> ObjectWatch:
    return ObjectWatch(CONFIG)


def test_absent_tracked_and_silent(watch: ObjectWatch) -> None:
    (row,) = watch.rows(NOW_NS)
    assert (row.object, row.state, row.heard_ns) == ("cup", "absent", 0)
    watch.pose(pose(), NOW_NS)
    (row,) = watch.rows(NOW_NS + SECOND_NS)
    assert (row.state, row.registered, row.age_ms, row.sigma_m) == ("ok", True, 12.0, 0.0008)
    (row,) = watch.rows(NOW_NS + SECOND_NS + 1)
    assert row.state == "silent"
    watch.pose(pose(registered=False, tracking="unregistered"), NOW_NS)
    assert watch.rows(NOW_NS)[0].state == "unregistered"


def test_holders_last_as_long_as_contacts_come(watch: ObjectWatch) -> None:
    watch.contacts(contacts(), NOW_NS)
    (row,) = watch.rows(NOW_NS)
    assert row.held_by == row.touching == {"right": ["thumb", "index"]}
    (row,) = watch.rows(NOW_NS + SECOND_NS + 1)
    assert row.held_by == row.touching == {}


def test_objects_of_no_table_are_shown_but_bounded(watch: ObjectWatch) -> None:
    for number in range(100):
        watch.pose(pose(f"o{number:02d}"), NOW_NS)
        watch.contacts(contacts(f"c{number:02d}"), NOW_NS)
    watch.pose(pose(), NOW_NS)
    names = [row.object for row in watch.rows(NOW_NS)]
    assert names[:2] == ["cup", "c00"]
    assert len(names) == 32


def test_a_monitor_has_objects_only_where_somebody_listens_to_them() -> None:
    monitor = RigMonitor(CONFIG, NOW_NS)
    assert monitor.state(NOW_NS).objects == []
    watch = monitor.watch_objects()
    assert monitor.watch_objects() is watch
    watch.pose(pose(), NOW_NS)
    assert [row.state for row in monitor.state(NOW_NS).objects] == ["ok"]
