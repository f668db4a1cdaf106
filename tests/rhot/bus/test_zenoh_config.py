"""What is set of Zenoh does what it is set for."""

from __future__ import annotations

import socket
import threading

import pytest
import zenoh

from rhot.bus.zenoh_config import client_config


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
