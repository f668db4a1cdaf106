"""Questions and answers over Zenoh queries: state that is asked for, and requests that change it.

An answer is a message, bytes, or an error with a typed `Refusal`. Nobody there: no answer arrives,
and the query ends at its timeout. Everything that arrives is untrusted: what is too large or does
not decode counts as no answer.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any, TypeVar

import msgspec
import zenoh

from rhot import clock
from rhot.errors import UNDECODABLE, BusError, RefusedError, RhotError
from rhot.messages import Refusal
from rhot.topics import Topic

T = TypeVar("T")
Answer = msgspec.Struct | bytes | None
Handler = Callable[[], Answer | Awaitable[Answer]]
RequestHandler = Callable[[bytes], Awaitable[Answer]]

log = logging.getLogger("rhot.bus")

# Zenoh's own choice keeps one answer of each key, and holds it until all have come.
_EVERYBODY, _EACH = zenoh.QueryTarget.ALL, zenoh.ConsolidationMode.NONE
# A reason is for people: one that is longer than a page helps nobody, and may not fit an answer.
_MAX_REASON = 2000


@dataclass(frozen=True)
class Reply:
    """One raw answer; received_ns is read in Zenoh's thread."""

    payload: bytes
    received_ns: int


@dataclass
class Replies:
    """What one query brought."""

    good: list[Reply] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)


class Asker:
    """Asks over one session, from one event loop."""

    def __init__(self, session: zenoh.Session, loop: asyncio.AbstractEventLoop) -> None:
        self._session, self._loop = session, loop

    async def replies(
        self,
        topic: Topic[Any],
        key: str,
        timeout_s: float,
        request: msgspec.Struct | None = None,
        now_ns: Callable[[], int] = clock.now_ns,
        *,
        all_of_one_key: bool = False,
    ) -> Replies:
        """Everything that answers within timeout_s: of several that answer with the same key one,
        or all_of_one_key, each as soon as it is there.
        """
        replies = Replies()
        done: asyncio.Future[None] = self._loop.create_future()

        def on_reply(reply: zenoh.Reply) -> None:
            received_ns = now_ns()
            if reply.ok is not None and len(reply.ok.payload) <= topic.max_bytes:
                replies.good.append(Reply(reply.ok.payload.to_bytes(), received_ns))
            elif reply.err is not None and len(reply.err.payload) <= topic.max_bytes:
                replies.refusals.append(_refusal(reply.err.payload.to_bytes()))

        def finish() -> None:
            if not done.done():
                done.set_result(None)

        def on_end() -> None:
            with contextlib.suppress(RuntimeError):  # the loop is gone, and nobody waits
                self._loop.call_soon_threadsafe(finish)

        self._session.get(
            key,
            zenoh.handlers.Callback(on_reply, on_end),
            payload=None if request is None else msgspec.json.encode(request),
            timeout=timeout_s,
            target=_EVERYBODY if all_of_one_key else None,
            consolidation=_EACH if all_of_one_key else None,
        )
        # Zenoh ends every query at its timeout; a second more covers a link that dies meanwhile.
        # (Not wait_for: where the answer and a cancellation meet, Python 3.11's swallows the
        # cancellation, and its task runs for ever.)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(timeout_s + 1.0):
                await done
        return replies


def decoded(topic: Topic[T], replies: Replies) -> list[T]:
    """The answers as messages, bytes where the topic has none; what does not decode is left out."""
    if topic.message is None:
        return [reply.payload for reply in replies.good]  # type: ignore[misc]
    decoder = msgspec.json.Decoder(topic.message)
    answers: list[T] = []
    for reply in replies.good:
        with contextlib.suppress(*UNDECODABLE):
            answers.append(decoder.decode(reply.payload))
    return answers


def only_answer(topic: Topic[T], key: str, replies: Replies) -> T:
    """The one answer to a request; raises RefusedError with the service's reason, else BusError."""
    answers = decoded(topic, replies)
    if answers:
        return answers[0]
    if replies.refusals:
        raise RefusedError(replies.refusals[0].reason, replies.refusals[0].code)
    if replies.good:
        raise BusError(
            f"what answers on {key} is no {topic.encoding}; is it another version of rhot?"
        )
    raise BusError(f"nobody answers on {key}; `rhot top` shows which services are alive")


class Tasks:
    """Coroutines that Zenoh's threads start on the event loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._running: set[asyncio.Task[None]] = set()

    def start(self, coroutine: Coroutine[Any, Any, None]) -> None:
        """From any thread; nothing once the loop is gone."""
        try:
            self._loop.call_soon_threadsafe(self._run, coroutine)
        except RuntimeError:
            coroutine.close()

    def _run(self, coroutine: Coroutine[Any, Any, None]) -> None:
        task = self._loop.create_task(coroutine)
        self._running.add(task)
        task.add_done_callback(self._running.discard)

    def cancel(self) -> None:
        """End all of them."""
        for task in self._running:
            task.cancel()


class Answerer:
    """Answers the queries of one key: coroutines on the event loop, functions in Zenoh's thread."""

    def __init__(
        self, topic: Topic[Any], key: str, spawn: Callable[[Coroutine[Any, Any, None]], None]
    ) -> None:
        self._topic, self._key, self._spawn = topic, key, spawn

    def declare(
        self, session: zenoh.Session, on_query: Callable[[zenoh.Query], None]
    ) -> zenoh.Queryable[Any]:
        """Answer this key's queries so from now on."""
        return session.declare_queryable(self._key, on_query)

    def plain(self, handler: Handler) -> Callable[[zenoh.Query], None]:
        """A Zenoh callback for a handler without a request: a function, or a coroutine function."""

        def on_query(query: zenoh.Query) -> None:
            if asyncio.iscoroutinefunction(handler):
                self._spawn(self._later(query, handler))
                return
            with query:
                try:
                    self._send(query, handler())  # type: ignore[arg-type]
                except Exception as error:  # the asker waits: it must hear of any failure
                    self._refuse(query, error)

        return on_query

    def with_request(self, handler: RequestHandler) -> Callable[[zenoh.Query], None]:
        """A Zenoh callback for a handler that takes the request's payload, b"" if there is none."""

        def on_query(query: zenoh.Query) -> None:
            size = 0 if query.payload is None else len(query.payload)
            # Unread: an answer of any kind would make large requests cheap for who sends them.
            if size <= self._topic.max_bytes:
                payload = query.payload.to_bytes() if query.payload is not None else b""
                self._spawn(self._later(query, lambda: handler(payload)))

        return on_query

    async def _later(self, query: zenoh.Query, handler: Callable[[], Any]) -> None:
        with query:
            try:
                self._send(query, await handler())
            except Exception as error:  # likewise
                self._refuse(query, error)

    def _send(self, query: zenoh.Query, answer: Answer) -> None:
        if answer is not None:
            payload = answer if isinstance(answer, bytes) else msgspec.json.encode(answer)
            query.reply(self._key, payload, encoding=self._topic.encoding)

    def _refuse(self, query: zenoh.Query, error: Exception) -> None:
        if isinstance(error, RefusedError):
            refusal = Refusal(code=error.code, reason=str(error)[:_MAX_REASON])
        elif isinstance(error, UNDECODABLE):
            refusal = Refusal(code="malformed", reason=str(error)[:_MAX_REASON])
        elif isinstance(error, RhotError):
            refusal = Refusal(code="invalid", reason=str(error)[:_MAX_REASON])
        else:
            log.error("query %s failed", self._key, exc_info=error)
            refusal = Refusal(code="failed", reason=str(error)[:_MAX_REASON])
        query.reply_err(msgspec.json.encode(refusal), encoding=REFUSAL_ENCODING)


REFUSAL_ENCODING = "application/json;rhot.Refusal.1"


def _refusal(payload: bytes) -> Refusal:
    """The refusal in an error reply; another program's error becomes one, as far as it is text."""
    try:
        return msgspec.json.decode(payload, type=Refusal)
    except UNDECODABLE:
        text = payload.decode(errors="replace")[:_MAX_REASON]
        return Refusal(code="failed", reason=text or "an error without words")
