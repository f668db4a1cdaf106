"""Who needs charging."""

from __future__ import annotations

import pytest

from services.openvr_bridge.batteries import Batteries
from services.openvr_bridge.names import message_device
from services.openvr_bridge.sweep import Device


def low(batteries: Batteries, battery: float, charging: bool = False) -> bool:
    device = message_device(1, Device(3, "A", battery=battery, charging=charging))
    return "A" in batteries.texts([device])


@pytest.mark.parametrize(
    ("battery", "told"), [(0.0, True), (0.149, True), (0.15, False), (1.0, False), (-1.0, False)]
)
def test_under_15_percent(battery, told):
    assert low(Batteries(), battery) == told


def test_it_is_over_well_above_or_when_it_charges():
    batteries = Batteries()
    assert [low(batteries, b) for b in (0.16, 0.14, 0.16, 0.199, 0.2, 0.16)] == [
        False,
        True,
        True,
        True,
        False,
        False,
    ]
    assert not low(batteries, 0.05, charging=True)
