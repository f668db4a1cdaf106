"""What is set of Zenoh does what it is set for."""

from __future__ import annotations

import mmap
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import zenoh

from rhot.bus.zenoh_config import client_config, router_config
from rhot.errors import BusError


@pytest.mark.parametrize("config", [client_config, router_config])
@pytest.mark.parametrize(
    "wrong",
    ["", "127.0.0.1", "localhost:7447", "http://127.0.0.1:8080", "tcp/127.0.0.1", "tcp/a:99999"],
)
def test_what_is_no_address_of_a_router_is_said_to_be_none(config, wrong: str) -> None:
    with pytest.raises(BusError, match="write it like tcp/") as told:
        config(["tcp/127.0.0.1:7447", wrong])
    assert repr(wrong) in str(told.value)


def test_addresses_of_all_kinds_are_taken() -> None:
    client_config(["tcp/[::1]:7447", "udp/pi-left.local:7447", "tls/a:1#verify_name=false"])


def test_an_attempt_that_nobody_answers_is_given_up_and_made_anew() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        silent.settimeout(9.0)
        config = client_config([f"tcp/127.0.0.1:{silent.getsockname()[1]}"])
        config.insert_json5("connect/timeout_ms", "7000")
        opening = threading.Thread(target=_refused, args=(config,))
        opening.start()
        # Zenoh's own attempts last 10 s: there would be no second one.
        attempts = [silent.accept()[0] for _ in range(2)]
        for one in attempts:
            one.close()
        opening.join()


def _refused(config: zenoh.Config) -> None:
    with pytest.raises(zenoh.ZError):
        zenoh.open(config)


_ROUTER = """
import sys, zenoh
from rhot.bus.zenoh_config import router_config
router = zenoh.open(router_config([sys.argv[1]]))
print("up", flush=True)
sys.stdin.read()
"""
_SENDER = """
import sys, time, zenoh
from rhot.bus.zenoh_config import client_config
session = zenoh.open(client_config([sys.argv[1]]))
while True:
    session.put("test/image", bytes(400_000), congestion_control=zenoh.CongestionControl.BLOCK)
    time.sleep(0.02)
"""


def _process(code: str, endpoint: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", code, endpoint],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def _resident_mb(process: subprocess.Popen[str]) -> float:
    pages = int(Path(f"/proc/{process.pid}/statm").read_text().split()[1])
    return pages * mmap.PAGESIZE / 1e6


def test_a_router_keeps_nothing_of_a_killed_sender_of_pictures(endpoint: str) -> None:
    came = threading.Semaphore(0)
    with _process(_ROUTER, endpoint) as router:
        assert router.stdout.readline() == "up\n"
        with zenoh.open(client_config([endpoint])) as session:
            session.declare_subscriber("test/image", lambda _: came.release())
            resident_mb = [_pictures_of_one_sender(endpoint, came, router) for _ in range(4)]
        router.kill()
    # Through shared memory it was 7.4 MB for each.
    assert resident_mb[-1] - resident_mb[0] < 3.0, resident_mb


def _pictures_of_one_sender(
    endpoint: str, came: threading.Semaphore, router: subprocess.Popen[str]
) -> float:
    """The router's memory once a sender was heard and killed."""
    with _process(_SENDER, endpoint) as sender:
        for _ in range(10):
            assert came.acquire(timeout=30.0)
        sender.kill()
    # What is still on its way is not of the next one.
    while came.acquire(timeout=0.2):
        pass
    return _resident_mb(router)
