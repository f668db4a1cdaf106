"""Range of motion as therapists write it."""

from __future__ import annotations

import pytest

from studies.grasp.report.motion_range import JointRange, person_range
from studies.grasp.report.study import Entry, Person
from testing.synthetic_fingers import PEOPLE


@pytest.mark.parametrize(
    ("extension", "flexion", "text"),
    [
        (-10.0, 90.0, "10-0-90"),
        (15.0, 90.0, "0-15-90"),
        (0.4, 71.2, "0-0-71"),
        (-40, -16, "40-16-0"),
    ],
)
def test_neutral_zero(extension, flexion, text):
    joint = JointRange("pip", (extension, 0.0), (flexion, 0.0), (0.0, 0.0), 5)
    assert joint.neutral_zero == text


def test_a_persons_joints(people, recoveries):
    person = Person("s1", "index", [Entry("s1", people[0], recoveries[0])])
    found = person_range(person)
    mcp, pip, dip = found.joints
    closed_mcp, closed_pip = PEOPLE[0].closed_deg
    # Each closing reaches 97 to 100 % of it; the noise of 0.05 mm is 0.2 deg.
    assert mcp.flexion[0] == pytest.approx(0.985 * closed_mcp, abs=2.0)
    assert pip.flexion[0] == pytest.approx(0.985 * closed_pip, abs=2.0)
    assert mcp.extension[0] == pytest.approx(-4.0, abs=0.7)
    assert pip.extension[0] == pytest.approx(6.0, abs=0.7)
    assert (mcp.closings, found.source) == (3, "measured")
    flexed = sum(joint.flexion[0] for joint in found.joints)
    # MCP extends beyond straight, which does not count.
    missing = pip.extension[0] + dip.extension[0]
    assert found.total_active[0] == pytest.approx(flexed - missing, abs=0.01)


def test_without_the_recording_its_frames_tell(recoveries):
    person = Person("s1", "index", [Entry("s1", None, recoveries[0])])
    assert person_range(person).joints[1].flexion[0] == pytest.approx(100.0, abs=3.0)
