"""Base stations that move or vanish."""

from __future__ import annotations

import math

import pytest

from services.openvr_bridge.base_stations import BaseStations
from services.openvr_bridge.sweep import Device, Sweep
from testing.steamvr import BASE_STATION, Slot, records


def at(x_m: float, turned_deg: float = 0.0, universe: int = 7, **fields) -> Sweep:
    c, s = math.cos(math.radians(turned_deg)), math.sin(math.radians(turned_deg))
    slot = Slot(BASE_STATION, matrix=((c, -s, 0, x_m), (s, c, 0, 2), (0, 0, 1, 0)), **fields)
    return Sweep(0, records({1: slot}), {1: Device(BASE_STATION, "LHB-1", universe_id=universe)})


@pytest.mark.parametrize(
    ("x_m", "turned_deg", "told"),
    [(1.0, 0.0, False), (1.019, 0.9, False), (1.03, 0.0, True), (1.0, 1.5, True)],
)
def test_one_that_moved_is_told_until_it_is_back(x_m, turned_deg, told):
    stations = BaseStations()
    assert stations.look(at(1.0)) == ({}, {})
    moved, gone = stations.look(at(x_m, turned_deg))
    assert (bool(moved), gone) == (told, {})
    # Invalid and broken poses say nothing.
    assert stations.look(at(9.0, valid=False))[0] == moved
    assert stations.look(at(math.nan))[0] == moved
    assert stations.look(at(1.0)) == ({}, {})


def test_the_text_says_how_far():
    stations = BaseStations()
    stations.look(at(1.0))
    moved, _ = stations.look(at(1.25, 10.0))
    assert moved["LHB-1"] == "base station LHB-1 is 250 mm and 10.0 deg from where it was"


def test_in_another_universe_it_is_elsewhere_by_right():
    stations = BaseStations()
    stations.look(at(1.0))
    assert stations.look(at(5.0, universe=8)) == ({}, {})
    assert stations.look(at(5.1, universe=8))[0]


def test_one_that_is_gone_was_there_before():
    stations = BaseStations()
    assert stations.look(at(1.0, connected=False)) == ({}, {})
    stations.look(at(1.0))
    assert list(stations.look(at(1.0, connected=False))[1]) == ["LHB-1"]
    assert stations.look(at(1.0)) == ({}, {})
