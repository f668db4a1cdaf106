"""The bridge on a machine of its own, with a real certificate on a real router with roles."""

from __future__ import annotations

import asyncio
import contextlib

import msgspec
import openvr
import pytest

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.bus.security.credentials import router_endpoints
from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.messages import ClockEcho
from rhot.process.service import Service
from rhot.watch.rig_monitor import expected_services
from services.cli.live.router import running_router
from services.openvr_bridge.endpoints.own_name import check_instance
from services.openvr_bridge.service import serve
from testing.secured_rig import SecuredRig


@pytest.fixture
def secured(tmp_path) -> SecuredRig:
    return SecuredRig(tmp_path / "rig")


@pytest.fixture
def there(secured, rig) -> RigConfig:
    """rig.toml as the machine with SteamVR has it, whose certificate is called `steamvr`."""
    bus = msgspec.structs.replace(
        secured.config.bus,
        connect=(f"tls/127.0.0.1:{secured.port}",),
        certificates=str(secured.hosts.host("steamvr")),
    )
    objects = msgspec.structs.replace(rig.objects, host="gaming-pc")
    return msgspec.structs.replace(secured.config, object=rig.object, objects=objects, bus=bus)


async def test_all_it_says_gets_through_under_the_name_of_its_certificate(steamvr, secured, there):
    (instance,) = [name for service, name in expected_services(there) if "openvr" in service]
    check_instance(there, instance)
    async with contextlib.AsyncExitStack() as stack:
        await stack.enter_async_context(
            running_router(router_endpoints(secured.config), secured.config)
        )
        await stack.enter_async_context(asyncio.timeout(60.0))
        theirs = await stack.enter_async_context(open_bus("desk", secured.as_host("steamvr")))
        ours = await stack.enter_async_context(open_bus("desk", secured.open))
        tasks = await stack.enter_async_context(asyncio.TaskGroup())
        ours.answer(topics.CLOCK, lambda: ClockEcho(master_ns=clock.now_ns()))
        poses, events = ours.every(topics.OPENVR, 64), ours.every(topics.OPENVR_EVENT, 64)
        beats, alive = ours.every(topics.HEALTH, 8), ours.watch_alive()
        service = Service("openvr_bridge", instance, there, theirs, tasks)
        running = [tasks.create_task(one) for one in (serve(service), service.beat())]
        running.append(tasks.create_task(service.listen()))

        while (await anext(poses)).clock_sigma_ns < 0:
            pass
        came = await anext(alive)
        assert (came.service, came.instance, came.alive) == ("openvr_bridge", "steamvr", True)
        assert (await anext(beats)).instance == "steamvr"
        steamvr.happen(openvr.VREvent_SeatedZeroPoseReset)
        assert (await anext(events)).event_type == 804
        # It hears who else sends its tracker's poses, and a second bridge of its name.
        other = ours.publisher(topics.OPENVR, serial="LHR-1")
        namesake = ours.publisher(topics.HEALTH, service="openvr_bridge", instance="steamvr")
        double = msgspec.structs.replace(await anext(beats), session="0" * 16)
        wanted = {"device_twice", "second_service"}
        while not wanted <= {fault.code for fault in service.faults.standing()}:
            other.put(await anext(poses))
            namesake.put(double)
            await asyncio.sleep(0.2)
        for task in [*running, *tasks._tasks]:
            task.cancel()


def test_another_name_than_the_certificates_is_refused(there):
    with pytest.raises(ConfigError, match="`--instance steamvr`"):
        check_instance(there, "main")


def test_the_master_and_an_open_rig_may_call_it_as_they_like(secured, rig):
    check_instance(secured.config, "main")
    check_instance(rig, "main")
