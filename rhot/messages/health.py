"""What a service tells of itself once a second: its streams, its figures, and what is wrong.

The codes of faults, and what each one asks a person to do, are in rhot/faults/.
"""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from rhot.messages import Count, Host, Message, Name, NonNegative, SessionId, Stamp

Severity = Literal["error", "warning"]
# A service has a few faults at once, hardly ever ten; what says more is broken or hostile.
MAX_FAULTS, MAX_TEXT = 64, 1000
Text = Annotated[str, msgspec.Meta(max_length=MAX_TEXT)]


class Fault(Message, frozen=True, kw_only=True):
    """One thing that is wrong now; gone from the next Health once it is over.

    code is stable and stands in docs/guide/troubleshooting.md; subject says of which camera, marker
    or file, "" where there is only one; text is a plain sentence, action what to do; since_ns is on
    the sender's clock.
    """

    code: Name
    severity: Severity
    subject: Annotated[str, msgspec.Meta(max_length=100)] = ""
    text: Text
    action: Text
    since_ns: Stamp


class StreamHealth(Message, frozen=True, kw_only=True):
    """One stream of a service since the last beat.

    age is (now - stamp_ns) of what was sent, hop is (now - sent_ns) of what arrived; -1 where
    nothing was measured. ok compares rate_hz with expected_hz (0: no expectation) from the topics
    table.
    """

    key: str
    direction: Literal["in", "out"]
    count: Count
    rate_hz: NonNegative
    expected_hz: NonNegative
    ok: bool
    dropped: Count
    rejected: Count
    latency_p50_ms: float
    latency_p99_ms: float


class Health(Message, frozen=True, kw_only=True):
    """A service's state once a second. values holds its own figures, e.g.

    stage times in ms or the clock offset; faults is what is wrong now. session is the id of its
    Zenoh session, as the router lists it, and new at each start: two of one name are two services.
    cpu_percent and rss_mb are the process's, also where several services or rigs share it.
    """

    service: Name
    instance: Name
    stamp_ns: Stamp
    version: str
    pid: Count
    host: Host = ""
    session: SessionId = ""
    uptime_s: NonNegative
    state: str
    streams: list[StreamHealth]
    errors: Count
    last_error: str
    cpu_percent: NonNegative
    rss_mb: NonNegative
    values: dict[str, float] = msgspec.field(default_factory=dict)
    faults: Annotated[list[Fault], msgspec.Meta(max_length=MAX_FAULTS)] = msgspec.field(
        default_factory=list
    )
    sent_ns: Stamp = 0
