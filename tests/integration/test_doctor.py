"""`rhot doctor` names the right cause of each planted fault.

On the way to the rig, without any service of it:

 1. no router, on a host that is there
 2. a router at another port than rig.toml says
 3. the master's name is unknown
 4. rig.toml is broken
 5. this host's certificate has ended
 6. this host's certificate is of another authority

In a running rig of real processes (router, two trackers, fusion, solver), whose cameras get
rendered pictures:

 7. the session is stopped
 8. a camera is dark
 9. a camera is frozen
10. a camera is saturated
11. a camera is mirrored
12. a camera is slow
13. a camera's clock is off
14. a marker's range is wrong
15. a tracker is absent
16. a tracker hangs
17. the solver is absent
18. fusion is absent
19. fusion is not calibrated
20. a second fusion runs
21. a second service answers for the master's clock
22. a disk is nearly full

and two routers, which is one too many, before all of these.
"""

from __future__ import annotations

import asyncio
import contextlib
import datetime
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
import pytest_asyncio

from rhot import clock, topics
from rhot.bus.bus import Bus, open_bus
from rhot.client import RigClient
from rhot.files.config import load_rig
from rhot.messages import ClockEcho
from services.cli.doctor.diagnose import diagnose
from services.cli.doctor.links import Link, first_cause
from services.cli.doctor.observe import observe
from services.cli.doctor.text import links_text
from services.cli.live.router import running_router
from services.cli.live.supervisor import Child, Supervisor
from services.cli.live.up import children_of
from services.cli.live.working_copy import working_copy
from services.cli.pki.certificates import issue, make_authority
from services.cli.pki.folders import PkiFolder
from testing.picture_feed import PictureFeed

pytestmark = [pytest.mark.field, pytest.mark.timeout(600)]
# numba's first compilation on a loaded machine takes most of it; the doctor itself takes 6 s.
START_S, NAMED_S = 300.0, 90.0
# Slow enough for two cores that run other tests, too.
FPS, PICTURES = 10.0, 60
# A hue that nothing in the scene has, and no picture's noise reaches.
NOWHERE = {"hsv_low": [2, 250, 250], "hsv_high": [4, 255, 255]}


async def links_of(config: Path, connect: str | None = None) -> list[Link]:
    return diagnose(await observe(config, connect))


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


# The way to the rig.


@pytest.fixture
def sim_toml(repository: Path) -> Path:
    return repository / "config" / "sim.toml"


def test_no_router(sim_toml: Path) -> None:
    """As a person runs it: exit code, text and advice."""
    endpoint = free_endpoint()
    command = [sys.executable, "-m", "services.cli", "doctor", "--config", str(sim_toml)]
    ended = subprocess.run(
        [*command, "--connect", endpoint], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert "BROKEN  router" in ended.stdout
    assert "nothing listens at port" in ended.stdout
    assert "systemctl start rhot-router" in ended.stdout
    assert ended.stdout.splitlines()[-1] == "the first broken link: router"


async def test_a_router_at_another_port(sim_toml: Path) -> None:
    elsewhere = free_endpoint()
    command = [sys.executable, "-m", "services.cli", "router", "--listen", elsewhere]
    process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.PIPE)
    assert process.stdout is not None
    await process.stdout.readline()
    cause = first_cause(await links_of(sim_toml, free_endpoint()))
    process.terminate()
    await process.communicate()
    assert cause is not None
    assert cause.code == "router_unreachable"
    assert elsewhere in cause.text
    assert "connect" in cause.action


async def test_an_unknown_host(sim_toml: Path) -> None:
    cause = first_cause(await links_of(sim_toml, "tcp/no-such-master.invalid:7447"))
    assert cause is not None
    assert cause.code == "router_unreachable"
    assert "no computer of the name no-such-master.invalid" in cause.text


async def test_something_else_than_a_router_listens(sim_toml: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        links = await links_of(sim_toml, f"tcp/127.0.0.1:{other.getsockname()[1]}")
    cause = first_cause(links)
    assert cause is not None
    assert cause.code == "router_unreachable"
    assert "no Zenoh router" in cause.text


async def test_two_routers(tmp_path: Path) -> None:
    """Of which a service meets the first that answers, and not the other's services."""
    one, other = free_endpoint(), free_endpoint()
    path = tmp_path / "rig.toml"
    path.write_text(f'[bus]\nconnect = ["{one}", "{other}"]\n', encoding="utf-8")
    async with running_router([one]), running_router([other]):
        cause = first_cause(await links_of(path))
    assert cause is not None
    assert (cause.name, cause.code) == ("router", "second_service")


async def test_a_broken_rig_toml(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text("[rig]\nnmae = 'desk'\n", encoding="utf-8")
    cause = first_cause(await links_of(path))
    assert cause is not None
    assert cause.code == "config_broken"
    assert "nmae" in cause.text


@pytest.mark.parametrize(
    ("planted", "says"), [("ended", "ended on"), ("stranger", "another authority")]
)
async def test_certificates(tmp_path: Path, sim_toml: Path, planted: str, says: str) -> None:
    now = datetime.datetime.now(datetime.UTC)
    before = now - datetime.timedelta(days=4000) if planted == "ended" else now
    ours, hosts = make_authority("sim", now), PkiFolder(tmp_path / "made")
    theirs = make_authority("sim", now) if planted == "stranger" else ours
    hosts.write_host("master", issue(ours, "master", "m", ["127.0.0.1"], now), ours)
    hosts.write_host("pi", issue(theirs, "camera", "left", [], before), theirs)
    if planted == "stranger":  # it believes in the rig's authority, but is of its own
        (hosts.host("pi") / "ca.pem").write_bytes(ours.certificate_pem)
    port = free_endpoint().rpartition(":")[2]
    files = hosts.host("master")
    options = (
        f"root_ca_certificate_file={files}/ca.pem;listen_certificate_file={files}/own.pem;"
        f"listen_private_key_file={files}/own.key;enable_mtls=true"
    )
    path = tmp_path / "rig.toml"
    path.write_text(
        f'[bus]\nconnect = ["tls/127.0.0.1:{port}"]\ncertificates = "made/pi"\n', encoding="utf-8"
    )
    async with running_router([f"tls/127.0.0.1:{port}#{options}"]):
        cause = first_cause(await links_of(path))
    assert cause is not None
    assert (cause.name, cause.code) == ("certificates", "certificate_refused")
    assert says in cause.text or "authority" in cause.text


# A running rig.


@dataclass
class Rig:
    """A rig of real processes; its cameras' pictures are the feed's."""

    config: Path
    endpoint: str
    bus: Bus
    feed: PictureFeed
    children: dict[str, Child]
    supervisor: Supervisor
    logged: list[str] = field(default_factory=list)
    keepers: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    last: list[Link] = field(default_factory=list)

    def start(self, name: str) -> None:
        child = self.children[name]
        self.keepers[name] = asyncio.create_task(self.supervisor.keep_running(child))

    async def stop(self, name: str) -> None:
        keeper = self.keepers.pop(name)
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)

    async def named(self, *codes: str) -> Link:
        """The first broken link, once it has one of these codes."""
        async with self.patience(f"the doctor does not name {' or '.join(codes)}"):
            while True:
                self.last = await links_of(self.config, self.endpoint)
                cause = first_cause(self.last)
                if cause is not None and cause.code in codes:
                    return cause
        raise AssertionError

    async def well(self, seconds: float = START_S) -> None:
        """Wait until every link holds."""
        async with self.patience("the rig is not well", seconds):
            while True:
                self.last = await links_of(self.config, self.endpoint)
                if first_cause(self.last) is None:
                    return

    @contextlib.asynccontextmanager
    async def patience(self, about: str, seconds: float = NAMED_S) -> AsyncIterator[None]:
        try:
            async with asyncio.timeout(seconds):
                yield
        except TimeoutError:
            said = links_text(self.last) if self.last else "nothing"
            logged = "\n".join(self.logged[-30:])
            pytest.fail(f"{about}; it says:\n{said}\nthe services logged:\n{logged}")


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def rig() -> AsyncIterator[Rig]:
    endpoint = free_endpoint()
    with working_copy() as config:
        text = config.read_text(encoding="utf-8")
        text = text.replace('source = "simulator"', f'source = "simulator"\nfps = {FPS}')
        config.write_text(text[: text.index("[[object]]")], encoding="utf-8")
        feed = PictureFeed.rendered(config, PICTURES)
        wanted = children_of(load_rig(config), config, viewer=False, endpoint=[endpoint])
        children = {child.name: child for child in wanted if child.name != "simulator"}
        logged: list[str] = []
        supervisor = Supervisor(lambda *line: logged.append(" ".join(line)))
        async with open_router_first(supervisor, children), open_bus("sim", [endpoint]) as bus:
            found = Rig(config, endpoint, bus, feed, children, supervisor, logged)
            playing = asyncio.create_task(feed.run(bus))
            for name in children:
                if name != "router":
                    found.start(name)
            try:
                await found.well()
                yield found
            finally:
                playing.cancel()
                for name in list(found.keepers):
                    await found.stop(name)


@contextlib.asynccontextmanager
async def open_router_first(
    supervisor: Supervisor, children: dict[str, Child]
) -> AsyncIterator[None]:
    router = asyncio.create_task(supervisor.keep_running(children["router"]))
    try:
        yield
    finally:
        router.cancel()
        await asyncio.gather(router, return_exceptions=True)


in_rig = pytest.mark.asyncio(loop_scope="module")


@in_rig
async def test_the_session_is_stopped(rig: Rig) -> None:
    client = RigClient(rig.bus)
    client.stop()
    try:
        cause = await rig.named("session_stopped")
        assert "rhot session start" in cause.action
    finally:
        client.start()
    await rig.well()


@in_rig
@pytest.mark.parametrize(
    ("planted", "code"),
    [
        ("dark", "camera_dark"),
        ("freeze", "camera_frozen"),
        ("white", "camera_saturated"),
        ("mirror", "cameras_mirrored"),
    ],
)
async def test_a_camera_picture_is_wrong(rig: Rig, planted: str, code: str) -> None:
    getattr(rig.feed.cameras["left"], planted)()
    try:
        cause = await rig.named(code)
        assert "left" in f"{cause.name} {cause.text}"
    finally:
        rig.feed.cameras["left"].well()
    await rig.well()


@in_rig
async def test_a_camera_is_slow(rig: Rig) -> None:
    rig.feed.cameras["right"].every = 3
    try:
        await rig.named("camera_slow")
        # On a machine with much to do the other one may be slow as well.
        slow = {link.name: link.text for link in rig.last if link.code == "camera_slow"}
        assert "of 10" in slow["camera right"]
    finally:
        rig.feed.cameras["right"].well()
    await rig.well()


@in_rig
async def test_a_camera_clock_is_off(rig: Rig) -> None:
    rig.feed.cameras["right"].ahead_ns = 3_000_000_000
    try:
        cause = await rig.named("camera_clock_off")
        assert "right" in cause.text
    finally:
        rig.feed.cameras["right"].well()
    await rig.well()


@in_rig
async def test_a_range_is_wrong(rig: Rig) -> None:
    path = rig.config.parent / "calibration" / "left.colors.json"
    right_one = path.read_bytes()
    wrong = json.loads(right_one)
    wrong["colors"]["lime"] = NOWHERE
    path.write_text(json.dumps(wrong), encoding="utf-8")
    try:
        cause = await rig.named("marker_not_seen")
        assert cause.name == "markers of left"
        assert "lime" in cause.text
        assert "rhot calibrate colors left" in cause.action
    finally:
        path.write_bytes(right_one)
    await rig.well()


@in_rig
async def test_a_tracker_is_absent(rig: Rig) -> None:
    await rig.stop("pi_tracker/left")
    try:
        cause = await rig.named("service_absent")
        assert cause.name == "pi_tracker/left"
        assert "rhot-pi-tracker@left" in cause.action
    finally:
        rig.start("pi_tracker/left")
    await rig.well()


@in_rig
async def test_a_tracker_hangs(rig: Rig) -> None:
    os.kill(rig.supervisor.pids["pi_tracker/right"], signal.SIGSTOP)
    try:
        # Its token is gone with the router's patience: who looks then has never heard of it.
        cause = await rig.named("service_silent", "service_gone", "service_absent")
        assert cause.name == "pi_tracker/right"
    finally:
        os.kill(rig.supervisor.pids["pi_tracker/right"], signal.SIGCONT)
    await rig.well()


@in_rig
async def test_the_solver_is_absent(rig: Rig) -> None:
    await rig.stop("solver")
    try:
        assert (await rig.named("service_absent")).name == "solver"
    finally:
        rig.start("solver")
    await rig.well()


@in_rig
async def test_fusion_is_absent_then_not_calibrated(rig: Rig) -> None:
    await rig.stop("fusion")
    geometry = rig.config.parent / "calibration" / "rig.json"
    content = geometry.read_bytes()
    try:
        assert (await rig.named("service_absent")).name == "fusion"
        geometry.unlink()
        rig.start("fusion")
        cause = await rig.named("not_calibrated")
        assert "rig.json" in cause.text
    finally:
        geometry.write_bytes(content)
    await rig.well()


@in_rig
async def test_a_second_fusion_runs(rig: Rig) -> None:
    rig.children["second"] = rig.children["fusion"]
    rig.start("second")
    try:
        cause = await rig.named("second_service")
        assert "fusion" in cause.text
    finally:
        await rig.stop("second")
    await rig.well()


@in_rig
async def test_a_second_clock_answers(rig: Rig) -> None:
    async with open_bus("sim", [rig.endpoint]) as stranger:
        stranger.answer(
            topics.CLOCK,
            lambda: ClockEcho(
                master_ns=clock.now_ns() + 1_000_000_000, session=stranger.session, host="elsewhere"
            ),
        )
        cause = await rig.named("second_clock")
        assert "elsewhere" in cause.text
    await rig.well()


@pytest.fixture
def small_disk(rig: Rig) -> Iterator[Path]:
    """The folder of recordings on a file system of 100 MB."""
    folder = rig.config.parent / load_rig(rig.config).recorder.folder
    folder.mkdir(exist_ok=True)
    mount = ["mount", "-t", "tmpfs", "-o", "size=100m", "rhot-test", str(folder)]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("needs to be root, to mount a small disk")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


@in_rig
async def test_a_disk_is_nearly_full(rig: Rig, small_disk: Path) -> None:
    """Poses still come: the link is worse, and the advice is there."""
    async with rig.patience("no disk_low"):
        while not (low := [link for link in rig.last if link.code == "disk_low"]):
            rig.last = await links_of(rig.config, rig.endpoint)
    assert low[0].state == "worse"
    assert str(small_disk) in low[0].text
    assert low[0].action in links_text(rig.last)
