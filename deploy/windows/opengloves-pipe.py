"""Writes OpenGloves' named pipes with what rhot's bridge sends, on the Windows computer of SteamVR.

    py opengloves-pipe.py                                      the bridge runs on this computer
    py opengloves-pipe.py --listen 0.0.0.0 --from 192.168.1.5  it runs on that one

It needs Python 3.9 or newer and nothing else. Datagrams are one letter (L or R) and OpenGloves' own
struct of 120 bytes; whatever is not that is left unread. It waits for SteamVR as long as it takes,
and finds it again. docs/guide/bridges.md goes through it step by step.
"""

import argparse
import math
import socket
import struct
import sys
import time

PIPES = "\\\\.\\pipe\\vrapplication\\input\\glove\\v2\\"
HANDS = {b"L": "left", b"R": "right"}
STRUCT = struct.Struct("<20f5f2f8?f")
# Seconds between two looks for a pipe that is not there.
RETRY_S = 1.0


def checked(datagram):
    """(hand, struct) of a datagram, or None: what comes from the network may be anything."""
    hand = HANDS.get(datagram[:1])
    if hand is None or len(datagram) != 1 + STRUCT.size:
        return None
    floats = [one for one in STRUCT.unpack(datagram[1:]) if isinstance(one, float)]
    if not all(math.isfinite(one) and -1.0 <= one <= 1.0 for one in floats):
        return None
    return hand, datagram[1:]


class Pipe:
    """One hand's pipe, opened whenever it is there."""

    def __init__(self, path):
        self.path = path
        self.file = None
        self.next_look_s = 0.0

    def write(self, data):
        """Write one message, or drop it while the pipe is not there."""
        if self.file is None and time.monotonic() >= self.next_look_s:
            try:
                # Unbuffered: each write is one message of the pipe.
                self.file = open(self.path, "r+b", buffering=0)  # noqa: SIM115
                print(f"writing to {self.path}", flush=True)
            except OSError:
                self.next_look_s = time.monotonic() + RETRY_S
        if self.file is None:
            return
        try:
            self.file.write(data)
        except OSError as error:
            print(f"{self.path} is gone ({error}); looking for it again", flush=True)
            self.file.close()
            self.file = None


def newest(ear, allowed):
    """{hand: struct}: waits for a datagram, then takes all that have come; the newest counts."""
    found = {}
    ear.setblocking(True)
    while True:
        try:
            datagram, sender = ear.recvfrom(2048)
        except BlockingIOError:
            return found
        except ConnectionError:
            # Windows tells so of an answer that nobody took; there is none.
            continue
        ear.setblocking(False)
        one = checked(datagram) if allowed in ("", sender[0]) else None
        if one is not None:
            found[one[0]] = one[1]


def main():
    """Until Ctrl-C."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--listen", default="127.0.0.1", help="own address; 127.0.0.1 if left out")
    parser.add_argument("--port", type=int, default=4243, help="port of [bridges.opengloves]")
    parser.add_argument("--from", dest="allowed", default="", help="take datagrams of this address")
    parser.add_argument("--pipes", default=PIPES, help="where the pipes are, for tests")
    options = parser.parse_args()
    pipes = {hand: Pipe(options.pipes + hand) for hand in HANDS.values()}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        try:
            ear.bind((options.listen, options.port))
        except OSError as error:
            parser.exit(
                2,
                f"cannot listen at {options.listen}:{options.port} ({error}); another one may run "
                "already: end it, or give another --port here and in rig.toml\n",
            )
        print(f"waiting for rhot at {options.listen}:{ear.getsockname()[1]}", flush=True)
        while True:
            for hand, data in newest(ear, options.allowed).items():
                pipes[hand].write(data)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(0)
