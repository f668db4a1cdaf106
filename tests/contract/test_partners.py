"""Two rigs with a router each, joined: each sees the other, and neither can change the other."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.security.credentials import router_endpoints
from rhot.messages import ClockEcho
from services.cli.live.router import running_router
from testing.secured_rig import SecuredRig

DEADLINE_S = 60.0
HAND = {"hand": "right"}


def two_rigs(folder, partners_of_lab: list[str]) -> tuple[SecuredRig, SecuredRig]:
    """desk, whose router connects to lab's; each believes in both authorities."""
    lab = SecuredRig(folder / "lab", "lab", partners=partners_of_lab)
    desk = SecuredRig(
        folder / "desk", "desk", partners=["lab"], routers=[f"tls/127.0.0.1:{lab.port}"]
    )
    both = desk.authority.certificate_pem + lab.authority.certificate_pem
    for rig in (desk, lab):
        (rig.hosts.host("master") / "ca.pem").write_bytes(both)
    return desk, lab


@pytest.fixture
async def joined(tmp_path):
    desk, lab = two_rigs(tmp_path, ["desk"])
    async with contextlib.AsyncExitStack() as stack:
        for rig in (lab, desk):
            await stack.enter_async_context(
                running_router(router_endpoints(rig.config), rig.config)
            )
        yield desk, lab


async def arrives(sender: Bus, topic, receiver: Bus, seconds: float, **names) -> bool:
    """Whether something arrives within that time, however often it is sent."""
    subscription = receiver.raw(topic, 8, **names)
    publisher = sender.publisher(topic, **names)

    async def send() -> None:
        while True:
            publisher.put_bytes(b"{}")
            await asyncio.sleep(0.05)

    sending = asyncio.create_task(send())
    try:
        async with asyncio.timeout(seconds):
            await anext(subscription)
        return True
    except TimeoutError:
        return False
    finally:
        sending.cancel()
        receiver.close(subscription)
        publisher.undeclare()


async def test_a_viewer_of_one_rig_sees_the_others_poses_and_changes_nothing(joined):
    desk, lab = joined
    async with (
        open_bus("lab", lab.open) as lab_master,
        open_bus("lab", lab.as_host("left")) as lab_left,
        open_bus("lab", desk.open) as at_desk,
        open_bus("lab", desk.as_host("laptop")) as viewer_at_desk,
        open_bus("*", desk.as_host("laptop")) as viewer_of_all,
        open_bus("desk", lab.open) as desk_seen_from_lab,
        open_bus("desk", desk.open) as desk_master,
    ):
        lab_master.answer(topics.CLOCK, lambda: ClockEcho(master_ns=7))
        lab_master.alive("fusion", "main")
        # Poses, previews, liveliness and questions cross.
        assert await arrives(lab_master, topics.POSE, viewer_at_desk, DEADLINE_S, **HAND)
        assert await arrives(desk_master, topics.POSE, desk_seen_from_lab, DEADLINE_S, **HAND)
        assert await arrives(lab_left, topics.PREVIEW, viewer_at_desk, DEADLINE_S, camera="left")
        for asker in (viewer_at_desk, viewer_of_all):
            assert await asker.get(topics.CLOCK, 10.0) == [ClockEcho(master_ns=7)]
        async with asyncio.timeout(DEADLINE_S):
            assert (await anext(viewer_at_desk.watch_alive())).service == "fusion"
        # Even desk's master cannot start, stop or set anything at lab, nor send lab's poses.
        assert not await arrives(at_desk, topics.SESSION, lab_left, 1.0)
        assert not await arrives(at_desk, topics.COLORS, lab_left, 1.0, camera="left")
        assert not await arrives(at_desk, topics.POSE, lab_master, 1.0, **HAND)


async def test_who_is_no_partner_sees_nothing(tmp_path):
    lab = SecuredRig(tmp_path / "lab", "lab")
    desk = SecuredRig(
        tmp_path / "desk", "desk", routers=[f"tls/127.0.0.1:{lab.port}"], partners=["lab"]
    )
    both = desk.authority.certificate_pem + lab.authority.certificate_pem
    for rig in (desk, lab):
        (rig.hosts.host("master") / "ca.pem").write_bytes(both)
    async with (
        running_router(router_endpoints(lab.config), lab.config),
        running_router(router_endpoints(desk.config), desk.config),
        open_bus("lab", lab.open) as lab_master,
        open_bus("lab", desk.open) as at_desk,
    ):
        assert not await arrives(lab_master, topics.POSE, at_desk, 2.0, **HAND)


async def test_a_router_does_not_wait_for_a_partner_that_is_away(tmp_path):
    """The partner may come a week later."""
    desk, lab = two_rigs(tmp_path, ["desk"])
    async with contextlib.AsyncExitStack() as stack:
        async with asyncio.timeout(DEADLINE_S):
            await stack.enter_async_context(
                running_router(router_endpoints(desk.config), desk.config)
            )
            desk_master = await stack.enter_async_context(open_bus("desk", desk.open))
        await stack.enter_async_context(running_router(router_endpoints(lab.config), lab.config))
        seen = await stack.enter_async_context(open_bus("desk", lab.open))
        assert await arrives(desk_master, topics.POSE, seen, DEADLINE_S, **HAND)
