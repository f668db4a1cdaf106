"""A router's connections give a silent host up, by a limit that listening sockets hand on."""

from __future__ import annotations

import os
import socket
import sys
from pathlib import Path

import pytest

from rhot.bus.stalled_links import give_up_stalled_connections


@pytest.mark.skipif(sys.platform != "linux", reason="the limit is Linux's")
def test_accepted_connections_have_the_limit_and_others_have_not():
    with socket.create_server(("127.0.0.1", 0)) as server:
        assert give_up_stalled_connections() >= 1
        with socket.create_connection(server.getsockname()) as ours, server.accept()[0] as accepted:
            option = (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT)
            assert accepted.getsockopt(*option) > 2000
            assert ours.getsockopt(*option) == 0
        # The sockets are still the server's own: looking has closed none of them.
        with socket.create_connection(server.getsockname()):
            pass


@pytest.mark.skipif(sys.platform != "linux", reason="descriptors are listed in /proc")
def test_looking_leaves_no_descriptor_open(tmp_path):
    """Files and pipes, which are no sockets, are among them."""
    ends = os.pipe()
    with (tmp_path / "file").open("w"):
        before = len(list(Path("/proc/self/fd").iterdir()))
        for _ in range(10):
            give_up_stalled_connections()
        assert len(list(Path("/proc/self/fd").iterdir())) == before
    for end in ends:
        os.close(end)
