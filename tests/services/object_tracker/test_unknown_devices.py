"""Devices that nobody named are told of while they are there."""

from __future__ import annotations

from services.object_tracker.unknown_devices import UnknownDevices


def test_a_device_is_named_while_it_sends():
    found = UnknownDevices()
    assert found.texts(0.0) == {}
    found.note("LHR-2", 1.0)
    assert "LHR-2" in found.texts(2.0)["LHR-2"]
    assert found.texts(7.0) == {}


def test_ten_thousand_serials_are_sixteen():
    found = UnknownDevices()
    for number in range(10_000):
        found.note(f"LHR-{number}", 1.0)
    assert len(found.texts(1.0)) == 16
