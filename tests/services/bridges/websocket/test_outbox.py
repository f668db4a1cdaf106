"""What one client is still to get."""

from __future__ import annotations

from services.bridges.websocket.outbox import Outbox
from services.bridges.websocket.protocol import EVERYTHING, request_from


def test_only_the_newest_waits():
    outbox = Outbox()
    for number in range(5):
        assert outbox.put("hand/left/pose", f"{number}")
        assert outbox.put("object/cup/pose", f"cup {number}")
    assert outbox.take() == ["4", "cup 4"]
    assert outbox.take() == []
    assert outbox.skipped == 8


def test_a_request_holds_at_once_also_for_what_waits():
    outbox = Outbox()
    outbox.put("hand/left/pose", "hand")
    outbox.put("object/cup/pose", "cup")
    outbox.ask(request_from('{"subscribe":["object/*/pose"]}'))
    outbox.put_always("subscribed", "yes")
    assert not outbox.put("hand/left/pose", "hand")
    assert outbox.take() == ["cup", "yes"]
    outbox.ask(EVERYTHING)
    assert outbox.put("hand/left/pose", "hand")


def test_names_from_the_network_do_not_pile_up():
    outbox = Outbox()
    for number in range(1000):
        outbox.put(f"object/o{number}/pose", "x")
    assert len(outbox.take()) == 256
