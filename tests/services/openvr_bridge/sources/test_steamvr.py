"""All calls of openvr, against the real binding on a stand-in for Valve's client."""

from __future__ import annotations

import sys

import openvr
import pytest

from rhot import clock
from rhot.errors import SourceError
from services.openvr_bridge.sources.steamvr import SteamVr
from testing.steamvr import HMD, device, init_error


def test_a_sweep_has_every_slot_as_it_is(steamvr):
    steamvr.slots[0] = device("HMD-1", HMD, battery=None, universe=9)
    steamvr.slots[3].matrix = ((1, 0, 0, 0.1), (0, 1, 0, 0.2), (0, 0, 1, 0.3))
    before_ns = clock.now_ns()
    sweep = SteamVr().sweep()
    assert before_ns <= sweep.stamp_ns <= clock.now_ns()
    assert len(sweep.poses) == 64
    assert sweep.poses[3]["mDeviceToAbsoluteTracking"]["m"][:, 3].tolist() == pytest.approx(
        [0.1, 0.2, 0.3]
    )
    tracker, headset = sweep.devices[3], sweep.devices[0]
    assert (tracker.serial, tracker.battery, tracker.universe_id) == ("LHR-1", 0.5, 7)
    assert (headset.device_class, headset.battery, headset.universe_id) == (1, -1.0, 9)
    # Raw, predicted by nothing, in the background: SteamVR is not started, no headset is needed.
    assert steamvr.origins == {(openvr.TrackingUniverseRawAndUncalibrated, 0.0)}
    assert steamvr.applications == {openvr.VRApplication_Background}


def test_a_later_sweep_leaves_an_earlier_one_alone(steamvr):
    vr = SteamVr()
    first = vr.sweep()
    steamvr.slots[3].velocity = (1.0, 0.0, 0.0)
    second = vr.sweep()
    assert first.poses[3]["vVelocity"]["v"][0] == 0.0
    assert second.poses[3]["vVelocity"]["v"][0] == 1.0


def test_devices_come_at_once_by_their_event_and_soon_without_one(steamvr):
    vr = SteamVr()
    steamvr.slots[60] = device("LHR-2")
    steamvr.slots[61] = device("LHR-3")
    steamvr.happen(openvr.VREvent_TrackedDeviceActivated, 61)
    assert set(vr.sweep().devices) == {3, 61}
    assert {3, 60, 61} == set([vr.sweep() for _ in range(64)][-1].devices)
    del steamvr.slots[60]
    assert {3, 61} == set([vr.sweep() for _ in range(64)][-1].devices)


@pytest.mark.parametrize("kind", [801, 804, 808])
def test_another_universe_counts_from_its_event_on(steamvr, kind):
    vr = SteamVr()
    steamvr.slots[3].properties[openvr.Prop_CurrentUniverseId_Uint64] = 8
    steamvr.happen(kind)
    assert vr.sweep().devices[3].universe_id == 8


@pytest.mark.parametrize("code", [*range(1, 17), 18, 99])
def test_a_property_that_fails_keeps_what_it_said_or_is_missing(steamvr, code):
    vr = SteamVr()
    slot = steamvr.slots[3]
    slot.errors = dict.fromkeys(slot.properties, code)
    steamvr.happen(100, 3)
    known = vr.sweep().devices[3]
    assert (known.serial, known.model, known.universe_id) == ("LHR-1", "VIVE Tracker 3.0", 7)
    assert (known.battery, known.charging) == (-1.0, False)
    never_heard = SteamVr().sweep().devices[3]
    assert (never_heard.serial, never_heard.universe_id) == ("", 0)


@pytest.mark.parametrize("serial", ["", "LHR/1 x", "ü" * 200, b"\xff\xfe"])
def test_strange_serials_are_read_as_they_are(steamvr, serial):
    steamvr.slots[3] = device(serial)
    told = SteamVr().sweep().devices[3].serial
    assert told == (serial if isinstance(serial, str) else "")


@pytest.mark.parametrize("battery", [float("nan"), float("inf"), 55.0])
def test_a_battery_that_cannot_be_is_no_battery(steamvr, battery):
    steamvr.slots[3] = device("LHR-1", battery=battery)
    assert not 0.0 <= SteamVr().sweep().devices[3].battery <= 1.0


def test_a_flood_of_events_comes_in_portions(steamvr):
    for _ in range(150):
        steamvr.happen(openvr.VREvent_PropertyChanged, 3)
    steamvr.happen(100, 0xFFFFFFFF)
    steamvr.happen(101, 64)
    vr = SteamVr()
    assert [len(vr.sweep().events) for _ in range(4)] == [64, 64, 24, 0]


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("InitError_Init_PathRegistryNotFound", "install it and start it once"),
        ("InitError_Init_InstallationNotFound", "is not installed"),
        ("InitError_Init_NoServerForBackgroundApp", "does not run; start it"),
        ("InitError_Init_HmdNotFound", "docs/guide/steamvr.md"),
        ("InitError_IPC_ServerInitFailed", "install and start SteamVR"),
    ],
)
def test_a_steamvr_that_is_not_there_says_what_to_do(steamvr, name, advice):
    steamvr.init_error = init_error(name)
    assert str(steamvr.init_error) == ""
    with pytest.raises(SourceError, match=f"\\({name}\\).*{advice}"):
        SteamVr()


def test_an_error_of_a_newer_openvr_is_one_all_the_same(steamvr):
    steamvr.init_error = KeyError(4711)
    with pytest.raises(SourceError, match="4711"):
        SteamVr()


def test_without_the_package_it_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "openvr", None)
    with pytest.raises(SourceError, match=r"rhot\[openvr\]"):
        SteamVr()


def test_the_real_library_without_steamvr():
    with pytest.raises(SourceError, match=r"SteamVR cannot be reached \(InitError_"):
        SteamVr()
