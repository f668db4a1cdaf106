"""Listening sockets as /proc lists them."""

from __future__ import annotations

import os
import socket
from pathlib import Path

from services.cli.rig.listening_sockets import inodes_of, listening_sockets

HEAD = (
    "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt uid timeout inode"
)


def test_a_listener_of_this_process_is_found_and_a_connection_is_not():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        with socket.create_connection(listener.getsockname()) as client:
            listening = {(one.host, one.port): one.inode for one in listening_sockets()}
            inode = listening[listener.getsockname()]
            assert inode in set(inodes_of(Path(f"/proc/{os.getpid()}")))
            assert client.getsockname() not in listening


def test_addresses_of_both_families_are_read(tmp_path):
    (tmp_path / "net").mkdir()
    row = "   0: {} {} {} 0:0 0:0 0 0 0 {}"
    four = [row.format("0100007F:1D17", "00000000:0000", "0A", 11)]
    four.append(row.format("0100007F:1D18", "0100007F:1D17", "01", 12))
    six = [row.format("00000000000000000000000001000000:1D17", "0:0", "0A", 13)]
    (tmp_path / "net/tcp").write_text("\n".join([HEAD, *four]) + "\n")
    (tmp_path / "net/tcp6").write_text("\n".join([HEAD, *six]) + "\n")
    found = [tuple(one) for one in listening_sockets(tmp_path)]
    assert found == [("127.0.0.1", 7447, "11"), ("::1", 7447, "13")]


def test_a_system_without_the_list_has_none(tmp_path):
    assert listening_sockets(tmp_path) == []
    assert list(inodes_of(tmp_path / "1")) == []
