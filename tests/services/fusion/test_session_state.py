"""The start broadcast's state."""

from __future__ import annotations

from rhot.messages import Session
from services.fusion.session_state import SessionState


def test_begins_as_running_and_follows_the_last_broadcast():
    state = SessionState(1000)
    assert state.session == Session(running=True, start_ns=1000)
    assert state.update(Session(running=False, start_ns=2000, sent_ns=7))
    assert state.session == Session(running=False, start_ns=2000)
    assert state.update(Session(running=True, start_ns=3000))


def test_the_echo_of_the_own_broadcast_changes_nothing():
    state = SessionState(1000)
    assert not state.update(Session(running=True, start_ns=1000, sent_ns=99))
