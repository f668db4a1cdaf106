"""Queries that carry a request."""

from __future__ import annotations

import asyncio
import contextlib

import msgspec
import pytest

from rhot import topics
from rhot.errors import BusError, CalibrationError, RefusedError
from rhot.messages.camera import FitRequest, FitResult


async def ask(asker, request, timeout_s=5.0):
    async with asyncio.timeout(60.0):
        while True:
            answers = await asker.get(topics.FIT, timeout_s, request=request, camera="left")
            if answers:
                return answers[0]
            await asyncio.sleep(0.05)


async def test_the_request_arrives_and_is_answered(pair):
    asker, answerer = pair
    got = []

    async def handler(payload):
        got.append(payload)
        return FitResult(error=f"{len(payload)} bytes")

    answerer.answer_requests(topics.FIT, handler, camera="left")
    request = FitRequest(auto=True)
    assert (await ask(asker, request)).error == f"{len(msgspec.json.encode(request))} bytes"
    assert (await ask(asker, None)).error == "0 bytes"
    assert [msgspec.json.decode(payload, type=FitRequest) for payload in got if payload] == [
        request
    ]


async def test_an_oversized_request_gets_no_answer_and_harms_nobody(pair):
    asker, answerer = pair
    seen = []

    async def handler(payload):
        seen.append(len(payload))
        return FitResult()

    class Large(msgspec.Struct):
        text: str

    answerer.answer_requests(topics.FIT, handler, camera="left")
    await ask(asker, None)
    assert (
        await asker.get(
            topics.FIT, 0.5, request=Large("x" * (topics.FIT.max_bytes + 1)), camera="left"
        )
        == []
    )
    await ask(asker, None)
    assert seen == [0, 0]


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (ValueError("no"), "failed"),
        (CalibrationError("no"), "invalid"),
        (RefusedError("no", "not_saved"), "not_saved"),
        (msgspec.ValidationError("no"), "malformed"),
        (RecursionError("no"), "malformed"),
    ],
)
async def test_a_handler_that_fails_is_a_typed_refusal(pair, error, code):
    asker, answerer = pair

    async def handler(payload):
        if payload:
            raise error
        return FitResult()

    answerer.answer_requests(topics.FIT, handler, camera="left")
    await ask(asker, None)
    assert await asker.get(topics.FIT, 0.5, request=FitRequest(), camera="left") == []
    with pytest.raises(RefusedError, match=r"^no$") as caught:
        await asker.request(topics.FIT, FitRequest(), 5.0, camera="left")
    assert caught.value.code == code
    # And the next one is answered.
    await ask(asker, None)


async def test_the_one_answer_to_a_request(pair):
    asker, answerer = pair

    async def handler(payload):
        return FitResult(error="yes")

    answerer.answer_requests(topics.FIT, handler, camera="left")
    await ask(asker, None)
    assert await asker.request(topics.FIT, FitRequest(), camera="left") == FitResult(error="yes")


async def test_nobody_there_and_nonsense_are_told_apart(pair):
    asker, answerer = pair

    async def nonsense(payload):
        return b"[1, 2"

    async def foreign(query_payload):
        raise RuntimeError("\x00" * 5000)

    with pytest.raises(BusError, match=r"nobody answers on rhot/test/camera/left/fit; `rhot top`"):
        await asker.request(topics.FIT, FitRequest(), 0.3, camera="left")
    answerer.answer_requests(topics.FIT, nonsense, camera="left")
    answerer.answer_requests(topics.COLORS, foreign, camera="left")
    async with asyncio.timeout(60.0):
        while True:
            with contextlib.suppress(RefusedError):
                try:
                    await asker.request(topics.FIT, FitRequest(), 0.5, camera="left")
                except BusError as error:
                    if "another version of rhot" in str(error):
                        break
    with pytest.raises(RefusedError) as caught:
        await asker.request(topics.COLORS, FitRequest(), 5.0, camera="left")
    assert caught.value.code == "failed"
    # A reason is for people: never longer than a page.
    assert len(str(caught.value)) == 2000


async def test_an_error_of_another_program_becomes_a_refusal(pair):
    """Any Zenoh program may answer with an error of its own: bytes that are no Refusal."""
    asker, answerer = pair
    key = topics.FIT.key("test", camera="left")

    def on_query(query):
        with query:
            query.reply_err(b"\xff\xfe{")

    queryable = answerer._session.declare_queryable(key, on_query)
    refused: RefusedError | None = None
    async with asyncio.timeout(60.0):
        # Until the router knows the queryable, nobody answers.
        while refused is None:
            try:
                await asker.request(topics.FIT, FitRequest(), 0.5, camera="left")
            except RefusedError as error:
                refused = error
            except BusError:
                continue
    assert refused.code == "failed"
    assert str(refused)
    queryable.undeclare()
