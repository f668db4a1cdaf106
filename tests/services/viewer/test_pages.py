"""Each rig's page leads to the others of its process, and gives no token away."""

from __future__ import annotations

from contextvars import copy_context

from rhot.files.rig_tables import Viewer
from rhot.process.rigs.context import PLACE
from services.viewer.pages import RigPage, announced, at_its_place, others


def test_rigs_that_choose_no_port_have_theirs_in_the_order_of_their_files():
    assert at_its_place(Viewer()).port == 8080
    context = copy_context()
    context.run(PLACE.set, 2)
    assert context.run(at_its_place, Viewer()).port == 8082
    assert context.run(at_its_place, Viewer(port=9000)).port == 9000


def test_pages_lead_to_each_other_while_they_are_open() -> None:
    desk, bench = (RigPage(rig, Viewer(), port) for rig, port in (("desk", 8080), ("bench", 8081)))
    with announced(desk):
        assert others(desk) == []
        with announced(bench):
            assert others(desk) == [("bench", "http://127.0.0.1:8081")]
            assert others(bench) == [("desk", "http://127.0.0.1:8080")]
        assert others(desk) == []


def test_a_token_is_told_only_to_who_has_given_it() -> None:
    desk, bench, hall = (
        RigPage(rig, Viewer(host="10.0.0.2", token=token), port)
        for rig, token, port in (
            ("desk", "a" * 24, 1),
            ("bench", "a" * 24, 2),
            ("hall", "b" * 24, 3),
        )
    )
    with announced(desk), announced(bench), announced(hall):
        assert others(desk) == [
            ("bench", f"http://10.0.0.2:2/?token={'a' * 24}"),
            ("hall", "http://10.0.0.2:3"),
        ]
        assert "a" * 24 not in str(others(hall))
