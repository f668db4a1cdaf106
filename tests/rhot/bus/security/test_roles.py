"""Names in certificates."""

from __future__ import annotations

import pytest

from rhot.bus.security.roles import cameras_by_certificate, common_name, identity
from rhot.errors import BusError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable


def test_a_common_name_says_rig_role_and_name():
    assert common_name("desk", "camera", "left") == "desk.camera.left"
    assert identity("desk.camera.left") == ("desk", "camera", "left")
    assert identity("my.desk.viewer.a.b") == ("my.desk", "viewer", "a.b")
    assert identity("desk.king.left") is None


@pytest.mark.parametrize(
    ("rig", "name"), [("a.camera.b", "c"), ("a/b", "c"), ("", "c"), ("a", ""), ("a", "../c")]
)
def test_names_that_could_be_read_in_two_ways_are_refused(rig, name):
    """Else one rig's camera could pass for another's."""
    with pytest.raises(BusError):
        common_name(rig, "camera", name)


def test_a_computer_has_one_certificate_for_all_its_cameras():
    cameras = [("left", "pi1"), ("low", "pi1"), ("right", "pi2"), ("desk", ""), ("wall", "")]
    rig = RigConfig(camera=[CameraTable(name=name, host=host) for name, host in cameras])
    assert cameras_by_certificate(rig) == {
        "left": ["left", "low"],
        "right": ["right"],
        "desk": ["desk"],
        "wall": ["wall"],
    }
