"""The running bridge: a stand-in SteamVR, a real router, a master's clock, a reader."""

from __future__ import annotations

import asyncio

import msgspec
import openvr
import pytest

from rhot import clock, topics
from rhot.errors import ConfigError
from rhot.messages import ClockEcho
from services.openvr_bridge import service as bridge
from services.openvr_bridge.service import serve
from services.openvr_bridge.sources.polling import StuckError
from testing.steamvr import BASE_STATION, device, init_error
from testing.waiting import until


def faults(service) -> dict[str, str]:
    return {f"{one.code} {one.subject}": one.text for one in service.faults.standing()}


async def test_poses_and_events_on_the_masters_clock(running, steamvr, rig):
    ahead_ns = 4_000_000
    async with running("openvr_bridge", serve, rig) as (service, bus):
        bus.answer(topics.CLOCK, lambda: ClockEcho(master_ns=clock.now_ns() - ahead_ns))
        poses, events = bus.every(topics.OPENVR, 64), bus.every(topics.OPENVR_EVENT, 64)
        pose = await anext(poses)
        while pose.clock_sigma_ns < 0:
            following = await anext(poses)
            assert (following.seq, following.stamp_ns > pose.stamp_ns) == (pose.seq + 1, True)
            pose = following
        assert abs(pose.clock_offset_ns - ahead_ns) < 20_000_000
        assert (pose.device.serial, pose.universe, pose.bPoseIsValid) == ("LHR-1", "raw:7", True)
        steamvr.slots[3].properties[openvr.Prop_CurrentUniverseId_Uint64] = 8
        steamvr.happen(openvr.VREvent_ChaperoneUniverseHasChanged)
        event = await anext(events)
        assert (event.event_type, event.universe) == (801, "raw:8")
        while pose.universe == "raw:7":
            pose = await anext(poses)
        await until(lambda: service.values.get("clock_sigma_ms", -1.0) >= 0.0)
        assert service.status == "1 of 1 devices tracked"
        assert "openvr/main/event" in next(s.key for s in service.bus.streams if "event" in s.key)


async def test_steamvr_that_quits_is_tried_again(running, steamvr, rig, monkeypatch):
    monkeypatch.setattr(bridge, "_RETRY_S", 0.2)
    steamvr.init_error = init_error("InitError_Init_NoServerForBackgroundApp")
    async with running("openvr_bridge", serve, rig) as (service, bus):
        poses, events = bus.every(topics.OPENVR, 64), bus.every(topics.OPENVR_EVENT, 64)
        await until(lambda: "does not run" in faults(service).get("source_lost steamvr", ""))
        assert service.state == "running"
        steamvr.init_error = None
        await anext(poses)
        assert "source_lost steamvr" not in faults(service)
        steamvr.init_error = init_error("InitError_Init_NoServerForBackgroundApp")
        steamvr.happen(openvr.VREvent_Quit)
        assert (await anext(events)).name == "Quit"
        await until(lambda: "source_lost steamvr" in faults(service))
        assert (steamvr.acknowledged, steamvr.closed) == (1, 1)
        assert faults(service).keys() == {"source_lost steamvr"}
        # Nobody expects poses meanwhile.
        assert not [one for one in service.bus.streams if "pose" in one.key]
        steamvr.init_error = None
        last = await anext(poses)
        while last.seq < 10:
            last = await anext(poses)
        assert steamvr.opened == 2


async def test_what_is_wrong_with_devices_is_told(running, steamvr, rig):
    steamvr.slots |= {
        4: device("LHR-2", battery=0.14),
        7: device("LHR-3"),
        9: device("LHR-3"),
        10: device("LHB-1", BASE_STATION),
    }
    async with running("openvr_bridge", serve, rig) as (service, bus):
        poses = bus.every(topics.OPENVR, 64)
        await until(lambda: len(faults(service)) == 2)
        assert faults(service) == {
            "device_battery LHR-2": "the battery of LHR-2 is at 14 %",
            "device_twice LHR-3": "devices 7 and 9 of SteamVR are both called LHR-3",
        }
        assert service.values["devices"] == 3
        steamvr.slots[7].connected = False
        steamvr.slots[4].properties[openvr.Prop_DeviceIsCharging_Bool] = True
        steamvr.slots[10].connected = False
        await until(lambda: faults(service).keys() == {"base_station_gone LHB-1"})
        while (await anext(poses)).device.index != 9:
            pass
        # Somebody else reads the cup's tracker as well.
        strange = bus.publisher(topics.OPENVR, serial="LHR-1")
        template = next(p for p in [await anext(poses) for _ in range(20)] if p.universe)
        while "device_twice LHR-1" not in faults(service):
            strange.put(template)
            await asyncio.sleep(0.02)
        assert "another program" in faults(service)["device_twice LHR-1"]
        await until(lambda: "device_twice LHR-1" not in faults(service))


async def test_a_steamvr_without_any_device_is_connected_anew(running, steamvr, rig, monkeypatch):
    monkeypatch.setattr(bridge, "_ALONE_S", 0.3)
    steamvr.slots[3].connected = False
    async with running("openvr_bridge", serve, rig) as (service, bus):
        poses = bus.every(topics.OPENVR, 64)
        await until(lambda: steamvr.opened >= 3)
        assert (steamvr.closed >= 2, faults(service)) == (True, {})
        steamvr.slots[3].connected = True
        while not (await anext(poses)).bDeviceIsConnected:
            pass


async def test_64_devices_have_a_stream_each(running, steamvr, rig):
    slow = msgspec.structs.replace(rig.objects, rate_hz=5.0)
    steamvr.slots = {slot: device(f"LHR-{slot}") for slot in range(64)}
    config = msgspec.structs.replace(rig, objects=slow)
    async with running("openvr_bridge", serve, config) as (service, bus):
        poses, heard = bus.every(topics.OPENVR, 512), {}
        while len(heard) < 64 or min(heard.values()) < 2:
            pose = await anext(poses)
            assert pose.device.serial == f"LHR-{pose.device.index}"
            heard[pose.device.serial] = pose.seq
        assert faults(service) == {}


async def test_a_slow_steamvr_is_polled_as_it_can(running, steamvr, rig):
    steamvr.poll_s = 0.05
    async with running("openvr_bridge", serve, rig) as (service, bus):
        poses = bus.every(topics.OPENVR, 64)
        first = await anext(poses)
        second = await anext(poses)
        assert second.seq == first.seq + 1
        await until(lambda: service.values.get("poll_ms", 0.0) >= 50.0)
        # Told with the next beat, if the first one had a single poll.
        await until(lambda: service.values["late_polls"] > 0)


async def test_a_steamvr_that_hangs_ends_the_bridge(running, steamvr, rig, monkeypatch):
    monkeypatch.setattr("services.openvr_bridge.sources.polling._SILENT_S", 0.3)
    monkeypatch.setattr("services.openvr_bridge.sources.polling._STOP_S", 0.1)
    with pytest.RaisesGroup(pytest.RaisesExc(StuckError, match="starts anew")):
        async with running("openvr_bridge", serve, rig) as (_, bus):
            await anext(bus.every(topics.OPENVR, 64))
            steamvr.stuck.set()
            await asyncio.Event().wait()


async def test_a_bug_is_no_lost_source(running, steamvr, rig, monkeypatch):
    def fail(*_):
        raise ZeroDivisionError

    monkeypatch.setattr(openvr.IVRSystem, "getTrackedDeviceClass", fail)
    with pytest.RaisesGroup(ZeroDivisionError):
        async with running("openvr_bridge", serve, rig):
            await asyncio.Event().wait()


async def test_a_coarse_clock_is_refused(running, steamvr, rig, monkeypatch):
    windows = msgspec.defstruct("Info", [("resolution", float)])(0.015625)
    monkeypatch.setattr("time.get_clock_info", lambda _: windows)
    with pytest.RaisesGroup(pytest.RaisesExc(ConfigError, match="15.6 ms.*Python 3.13")):
        async with running("openvr_bridge", serve, rig):
            await asyncio.Event().wait()
