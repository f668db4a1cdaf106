"""A line per object, within what room there is."""

from __future__ import annotations

from rhot.watch.rig_state import ObjectRow, RigState
from services.cli.live.top_objects import object_lines

PARTS = ["thumb", "index", "middle", "ring", "little", "palm"]


def state(*rows: ObjectRow) -> RigState:
    return RigState(
        rig="sim",
        stamp_ns=1,
        services=[],
        faults=[],
        cameras=[],
        ages=[],
        glass_to_pose_ms={},
        objects=list(rows),
    )


def test_state_age_sigma_and_who_holds() -> None:
    held = ObjectRow(
        object="cup",
        state="ok",
        registered=True,
        age_ms=12.3,
        touching={"right": PARTS, "left": ["palm"]},
        held_by={"right": PARTS[:2]},
    )
    precise = ObjectRow(object="mug", state="ok", registered=True, age_ms=4.0, sigma_m=0.0008)
    unsure = ObjectRow(object="box", state="out_of_range", age_ms=1e9, sigma_m=1.0)
    lines = object_lines(
        state(held, precise, unsure, ObjectRow(object="ball", state="absent")), None
    )
    assert lines == [
        "object cup: tracked, 12 ms; held by right: thumb index; touched by left: palm",
        "object mug: tracked, 4 ms, +-0.8 mm",
        "object box: out of the lighthouses' view, 99999 ms",
        "object ball: no pose has come",
    ]


def test_a_whole_hand_fits_80_columns() -> None:
    held = ObjectRow(object="cup", state="ok", age_ms=12.0, held_by={"right": PARTS})
    (line,) = object_lines(state(held), 24)
    assert len(line) <= 80


def test_those_that_are_not_tracked_come_first_where_not_all_fit() -> None:
    rows = [ObjectRow(object=f"o{number}", state="ok") for number in range(9)]
    rows[7] = ObjectRow(object="o7", state="lost")
    lines = object_lines(state(*rows), 24)
    assert len(lines) == 4
    assert lines[0].startswith("object o7: lost")
    assert lines[-1] == "... 6 more objects"
    assert object_lines(state(*rows), 5) == ["... 9 objects"]
    assert len(object_lines(state(*rows), None)) == 9
