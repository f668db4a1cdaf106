"""Queries that carry a request."""

from __future__ import annotations

import asyncio

import msgspec
import pytest

from rhot import topics
from rhot.bus.bus import open_bus
from rhot.camera_messages import FitRequest, FitResult


@pytest.fixture
async def pair(router):
    async with open_bus("test", [router]) as asker, open_bus("test", [router]) as answerer:
        yield asker, answerer


async def ask(asker, request, timeout_s=5.0):
    async with asyncio.timeout(10.0):
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


async def test_a_handler_that_fails_is_no_answer(pair):
    asker, answerer = pair

    async def handler(payload):
        if payload:
            raise ValueError("no")
        return FitResult()

    answerer.answer_requests(topics.FIT, handler, camera="left")
    await ask(asker, None)
    assert await asker.get(topics.FIT, 0.5, request=FitRequest(), camera="left") == []
    await ask(asker, None)
