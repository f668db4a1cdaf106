"""A second service of the same name is named by both, as long as it is there."""

from __future__ import annotations

import msgspec

from rhot.process.health.namesakes import Namesakes
from testing.sample_health import beat

OTHER = beat("fusion", stamp_ns=1, pid=77, host="laptop", session="bb", streams=[])


def test_own_beats_are_nobody_elses():
    found = Namesakes("bb")
    for second in range(5):
        found.note(OTHER, second)
    assert found.texts("desk", 10.0, 5.0) == {}


def test_the_second_is_named_by_the_first_and_the_first_by_the_second():
    found = Namesakes("aa")
    found.note(OTHER, 0.0)
    assert found.texts("desk", 100.0, 0.1) == {}, "the last beat of one that was replaced"
    found.note(OTHER, 1.0)
    (text,) = found.texts("desk", 100.0, 1.1).values()
    assert text == "another fusion runs for rig 'desk', on laptop (pid 77); it came later"
    (text,) = found.texts("desk", 2.0, 1.1).values()
    assert text.endswith("it was there first")
    assert found.texts("desk", 100.0, 6.0) == {}, "it has fallen silent"


def test_ten_thousand_sessions_are_eight():
    found = Namesakes("aa")
    for number in range(10_000):
        other = msgspec.structs.replace(OTHER, session=f"{number:08x}")
        found.note(other, 0.0)
        found.note(other, 0.0)
    assert len(found.texts("desk", 1.0, 0.0)) == 8
