"""The page on which joints are clicked: what it shows, what it takes, what it refuses."""

from __future__ import annotations

import json
import threading
import urllib.error
import urllib.request

import cv2
import numpy as np
import pytest

from services.cli.grasp.measuring.click_page import ClickServer, as_options, clicked

PICTURE = np.full((60, 80, 3), 90, np.uint8)


@pytest.fixture
def server():
    with ClickServer(PICTURE, "dots") as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def post(address, content):
    request = urllib.request.Request(f"{address}seeds", data=content, method="POST")
    with urllib.request.urlopen(request, timeout=10) as answer:
        return answer.read().decode()


def test_the_page_and_its_picture(server):
    with urllib.request.urlopen(server.address, timeout=10) as answer:
        page = answer.read().decode()
    assert '"index_wrist", "index_mcp"' in page
    with urllib.request.urlopen(f"{server.address}picture.png", timeout=10) as answer:
        picture = cv2.imdecode(np.frombuffer(answer.read(), np.uint8), cv2.IMREAD_COLOR)
    assert (picture == PICTURE).all()
    assert server.address.startswith("http://127.0.0.1:")


def test_who_does_not_know_its_path_gets_nothing(server):
    port = server.server_address[1]
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(f"http://127.0.0.1:{port}/picture.png", timeout=10)
    with pytest.raises(urllib.error.HTTPError, match="404"):
        post(f"http://127.0.0.1:{port}/", b'{"index_tip": [1, 2]}')
    assert server.seeds == {}


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b'{"index_nail": [1, 2]}', b"x" * 20_000])
def test_what_are_no_seeds_is_refused(server, content):
    with pytest.raises(urllib.error.HTTPError, match="40"):
        post(server.address, content)
    assert server.seeds == {}


def test_the_command_waits_for_the_answer():
    seeds = {"index_pip": [30.5, 20.0], "index_tip": [40.0, 25.0]}
    told = []

    def answer(line):
        address = line.split()[1]
        content = json.dumps(seeds).encode()
        told.append(threading.Thread(target=post, args=(address, content)))
        told[0].start()

    found = clicked(PICTURE, "edges", answer)
    told[0].join()
    assert found == {"index_pip": (30.5, 20.0), "index_tip": (40.0, 25.0)}
    assert as_options(found) == "--seed index_pip=30,20 --seed index_tip=40,25"
