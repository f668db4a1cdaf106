"""`rhot doctor` names what is wrong on the way to the rig, without any service of it: the router,
the master's name, rig.toml, this host's certificates.
"""

from __future__ import annotations

import asyncio
import datetime
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from services.cli.doctor.links import first_cause
from services.cli.live.router import running_router
from services.cli.pki.certificates import issue, make_authority
from services.cli.pki.folders import PkiFolder
from testing.loopback import free_endpoint
from testing.watched_rig import links_of

pytestmark = [pytest.mark.field, pytest.mark.timeout(300)]


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
