"""Who may do what, by real sessions with real certificates on a real router."""

from __future__ import annotations

import asyncio
import contextlib
import itertools

import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.bus.security.credentials import router_endpoints
from rhot.messages import ClockEcho
from services.cli.live.router import running_router
from testing.secured_rig import SecuredRig

HOSTS = ("left", "right", "laptop", "steamvr", "master")
DEADLINE_S = 60.0
_MARKS = itertools.count()
# Long enough for an answer on a busy machine; none comes to what is forbidden.
QUIET_S = 0.4
# Messages sent, a tenth of a second apart, until one is heard: to what may hear them, and to what
# may not.
PATIENT, FEW = 600, 20


class Everybody:
    """A bus for each host of the rig, and one on loopback without a certificate: "here"."""

    def __init__(self, buses: dict[str, Bus]) -> None:
        self.buses = buses

    async def arrives(self, sender, topic, receiver, sent: int = FEW, **names) -> bool:
        """Whether one of so many messages of a sender reaches the receiver."""
        return await _arrives(self.buses[sender], topic, self.buses[receiver], names, sent)


async def _arrives(
    sender: Bus, topic, receiver: Bus, names: dict[str, str], sent: int = FEW
) -> bool:
    subscription = receiver.raw(topic, 64, **names)
    publisher = sender.publisher(topic, **names)
    mark = f'"{next(_MARKS)}"'.encode()

    async def heard() -> None:
        async for sample in subscription:
            if sample.payload == mark:
                return

    waiting = asyncio.create_task(heard())
    try:
        for _ in range(sent):
            publisher.put_bytes(mark)
            if (await asyncio.wait([waiting], timeout=0.1))[0]:
                return True
        return False
    finally:
        waiting.cancel()
        receiver.close(subscription)
        publisher.undeclare()


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> SecuredRig:
    return SecuredRig(tmp_path_factory.mktemp("rig"))


@pytest.fixture
async def everybody(rig):
    async with contextlib.AsyncExitStack() as stack:
        await stack.enter_async_context(running_router(router_endpoints(rig.config), rig.config))
        endpoints = {name: rig.as_host(name) for name in HOSTS} | {"here": rig.open}
        async with asyncio.timeout(DEADLINE_S):
            buses = {
                name: await stack.enter_async_context(open_bus("desk", where))
                for name, where in endpoints.items()
            }
        yield Everybody(buses)


LEFT, RIGHT, HAND = {"camera": "left"}, {"camera": "right"}, {"hand": "right"}
HEALTH_LEFT = {"service": "pi_tracker", "instance": "left"}

ALLOWED = [
    ("left", topics.MARKERS, LEFT, "here"),
    ("left", topics.MARKERS, LEFT, "master"),
    ("left", topics.MARKERS, LEFT, "laptop"),
    ("left", topics.PREVIEW, LEFT, "laptop"),
    ("left", topics.HEALTH, HEALTH_LEFT, "here"),
    ("here", topics.SESSION, {}, "left"),
    ("master", topics.SESSION, {}, "left"),
    ("here", topics.COLORS, RIGHT, "right"),
    ("here", topics.EXPOSURE, RIGHT, "right"),
    ("here", topics.SIM_FRAME, RIGHT, "right"),
    ("here", topics.POSE, HAND, "laptop"),
    ("steamvr", topics.OPENVR, {"serial": "LHR-1"}, "here"),
    ("steamvr", topics.OPENVR_EVENT, {"host": "steamvr"}, "here"),
    ("steamvr", topics.HEALTH, {"service": "openvr_bridge", "instance": "steamvr"}, "here"),
    ("here", topics.OPENVR, {"serial": "LHR-1"}, "steamvr"),
    ("here", topics.SESSION, {}, "steamvr"),
]
FORBIDDEN = [
    ("left", topics.MARKERS, RIGHT, "here"),
    ("left", topics.POSE, HAND, "here"),
    ("left", topics.POINTS, HAND, "here"),
    ("left", topics.SESSION, {}, "here"),
    ("left", topics.SESSION, {}, "right"),
    ("left", topics.COLORS, RIGHT, "right"),
    ("left", topics.EXPOSURE, RIGHT, "right"),
    ("left", topics.HEALTH, {"service": "fusion", "instance": "main"}, "here"),
    ("left", topics.PREVIEW, LEFT, "right"),
    ("left", topics.MARKERS, LEFT, "right"),
    ("here", topics.SIM_FRAME, LEFT, "right"),
    ("here", topics.SIM_FRAME, LEFT, "laptop"),
    ("laptop", topics.POSE, HAND, "here"),
    ("laptop", topics.SESSION, {}, "here"),
    ("laptop", topics.COLORS, LEFT, "left"),
    ("laptop", topics.MARKERS, LEFT, "here"),
    ("steamvr", topics.OBJECT, {"object": "cup"}, "here"),
    ("steamvr", topics.MARKERS, LEFT, "here"),
    ("steamvr", topics.OPENVR_EVENT, {"host": "left"}, "here"),
    ("steamvr", topics.HEALTH, {"service": "openvr_bridge", "instance": "main"}, "here"),
    ("left", topics.OPENVR, {"serial": "LHR-1"}, "here"),
    ("here", topics.POSE, HAND, "steamvr"),
]


async def arrived(everybody, cases, sent: int) -> list[bool]:
    return await asyncio.gather(
        *(everybody.arrives(sender, topic, to, sent, **names) for sender, topic, names, to in cases)
    )


async def test_what_a_role_needs_passes_and_nothing_else_does(everybody):
    for case, got_through in zip(ALLOWED, await arrived(everybody, ALLOWED, PATIENT), strict=True):
        assert got_through, case
    # All links are up and carry messages by now.
    for case, got_through in zip(FORBIDDEN, await arrived(everybody, FORBIDDEN, FEW), strict=True):
        assert not got_through, case


async def test_another_rigs_pictures_and_poses_are_not_for_this_rigs_hosts(everybody, rig):
    async with contextlib.AsyncExitStack() as stack:
        lab = await stack.enter_async_context(open_bus("lab", rig.open))
        ours = [
            await stack.enter_async_context(open_bus("lab", rig.as_host(name)))
            for name in ("left", "laptop")
        ]
        what = ((topics.PREVIEW, RIGHT), (topics.POSE, HAND))
        asked = [_arrives(lab, topic, bus, names) for bus in ours for topic, names in what]
        assert not any(await asyncio.gather(*asked))


async def test_questions_are_for_those_who_may_ask_them(everybody):
    async def colors(_payload: bytes) -> bytes:
        return b"{}"

    buses = everybody.buses
    buses["left"].answer(topics.FRAME, lambda: b"PNG", **LEFT)
    buses["left"].answer_requests(topics.COLORS, colors, **RIGHT)
    buses["here"].answer(topics.CLOCK, lambda: ClockEcho(master_ns=1))
    async with asyncio.timeout(DEADLINE_S):
        while not await buses["here"].get(topics.FRAME, QUIET_S, **LEFT):
            pass
    for asker in ("left", "right", "laptop", "steamvr", "master"):
        assert await buses[asker].get(topics.CLOCK, DEADLINE_S), asker
    assert await buses["master"].get(topics.FRAME, DEADLINE_S, **LEFT)
    for asker in ("right", "laptop", "steamvr"):
        assert not await buses[asker].get(topics.FRAME, QUIET_S, **LEFT), asker
    # Left would answer for the right camera's colours, and is not asked.
    assert not await buses["here"].get(topics.COLORS, QUIET_S, **RIGHT)


async def test_nobody_is_alive_in_another_ones_name(everybody):
    buses = everybody.buses
    watches = {name: buses[name].watch_alive() for name in ("here", "laptop", "right")}
    buses["left"].alive("fusion", "main")
    buses["laptop"].alive("pi_tracker", "left")
    buses["left"].alive("pi_tracker", "left")
    for name in ("here", "laptop"):
        async with asyncio.timeout(DEADLINE_S):
            first = await anext(watches[name])
        assert (first.service, first.instance) == ("pi_tracker", "left"), name
    for watch in watches.values():
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(QUIET_S):
                await anext(watch)


async def test_the_routers_own_state_is_shown_on_this_machine_only(everybody, rig):
    def state(endpoints: list[str]) -> list[str]:
        config = zenoh.Config.from_json5(
            f'{{"mode": "client", "connect": {{"endpoints": {endpoints!r}}}}}'.replace("'", '"')
        )
        with zenoh.open(config) as session:
            replies = list(session.get("@/*/router", timeout=2.0))
        return [str(reply.ok.key_expr) for reply in replies if reply.ok]

    assert len(await asyncio.to_thread(state, rig.open)) == 1
    assert await asyncio.to_thread(state, rig.as_host("master")) == []
    assert await asyncio.to_thread(state, rig.as_host("laptop")) == []


async def test_a_certificate_that_rig_toml_does_not_name_may_do_nothing(everybody, rig):
    rig.make("thief", "viewer")
    async with open_bus("desk", rig.as_host("thief")) as thief:
        everybody.buses["thief"] = thief
        cases = [("here", topics.POSE, HAND, "thief"), ("thief", topics.POSE, HAND, "here")]
        assert not any(await arrived(everybody, cases, FEW))
        assert not await thief.get(topics.CLOCK, QUIET_S)
