"""Ranges fitted on the camera's machine to what is pointed at from another."""

from __future__ import annotations

import msgspec

from rhot import topics
from rhot.messages.camera import FitRequest, FitResult, PointedAt, picture_name
from services.pi_tracker.endpoints import picture_cache

FIT_S = 60.0


async def ask(client, request) -> FitResult:
    (result,) = await client.bus.get(topics.FIT, FIT_S, request=request, camera="left")
    return result


async def fetch(client) -> str:
    (png,) = await client.bus.get(topics.FRAME, 5.0, camera="left")
    return picture_name(png)


async def test_clicks_on_two_pictures_give_ranges_that_work(
    config, tracking, seen, picture, colors
):
    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        names = [await fetch(client), await fetch(client)]
        pointed = [
            PointedAt(color=color, picture=name, x_px=x, y_px=y)
            for name in names
            for color, (x, y) in picture[1].items()
        ]
        result = await ask(client, FitRequest(pointed=pointed))
        assert result.error == ""
        assert set(result.colors) == {"green", "blue"}
        assert {patch.color for patch in result.patches} == {"green", "blue"}
        assert result.residuals["colors"]["green"]["inside"] > 0.9
        # Asking alone changes nothing.
        assert await client.colors("left") == colors
        await client.set_colors(
            "left",
            msgspec.structs.replace(
                colors, date="d", tool="t", colors={**colors.colors, **result.colors}
            ),
        )
        await seen(client, "blue", "green")


async def test_a_proposal_of_what_stands_out(config, tracking, seen, picture):
    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        result = await ask(client, FitRequest(auto=True, pictures=[await fetch(client)]))
        assert set(result.colors) == {"green", "blue"}
        for patch in result.patches:
            x, y = picture[1][patch.color]
            left, top, width, height = patch.box_px
            assert left <= x <= left + width
            assert top <= y <= top + height


async def test_what_no_marker_is_painted_with_is_not_proposed(config, tracking, seen):
    """The room has colours, too: they would part ranges that nothing has to be parted from."""
    markers = {"index_tip": "green", "thumb_tip": "magenta"}
    hand = msgspec.structs.replace(config.hand["right"], markers=markers)
    async with tracking(msgspec.structs.replace(config, hand={"right": hand})) as (_, client):
        await seen(client, "green")
        names = [await fetch(client)]
        result = await ask(client, FitRequest(auto=True, pictures=names))
        assert set(result.colors) == {patch.color for patch in result.patches} == {"green"}
        assert not any("blue" in text for text in result.warnings)
        assert any("could be magenta: click there" in note for note in result.notes)


async def test_nothing_that_may_be_a_marker(config, tracking, seen):
    hand = msgspec.structs.replace(config.hand["right"], markers={"index_tip": "magenta"})
    async with tracking(msgspec.structs.replace(config, hand={"right": hand})) as (_, client):
        await seen(client)
        result = await ask(client, FitRequest(auto=True, pictures=[await fetch(client)]))
        assert "nothing that stands out in these pictures may be magenta" in result.error
        assert result.colors == {}


WRONG = [
    ({"x_px": 5.0, "y_px": 5.0}, "something grey"),
    ({"x_px": 5000.0, "y_px": 5.0}, "outside the picture, which is 240x160"),
    ({"x_px": 60.0, "y_px": 70.0, "width_px": -3.0, "height_px": 9.0}, "too small"),
]


async def test_places_without_paint_are_answered_with_the_reason(config, tracking, seen):
    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        name = await fetch(client)
        for pointed, words in WRONG:
            result = await ask(
                client, FitRequest(pointed=[PointedAt(color="green", picture=name, **pointed)])
            )
            assert words in result.error
            assert result.colors == {}


async def test_pictures_are_kept_for_a_while(config, tracking, seen, monkeypatch, picture):
    """The recent ones, and longer those that were pointed at."""
    monkeypatch.setattr(picture_cache, "_RECENT", 2)
    # Frames of one still picture have one name: each must differ to push others out.
    names = iter([f"{k:016x}" for k in range(100)])
    monkeypatch.setattr(picture_cache, "picture_name", lambda _: next(names))
    x, y = picture[1]["green"]
    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        for _ in range(3):
            await client.bus.get(topics.FRAME, 5.0, camera="left")
        gone = await ask(
            client,
            FitRequest(pointed=[PointedAt(color="green", picture=f"{0:016x}", x_px=x, y_px=y)]),
        )
        assert "not kept any more" in gone.error
        used = FitRequest(pointed=[PointedAt(color="green", picture=f"{2:016x}", x_px=x, y_px=y)])
        assert (await ask(client, used)).error == ""
        # A proposal is made of what is left.
        auto = FitRequest(auto=True, pictures=[f"{n:016x}" for n in range(3)])
        proposed = await ask(client, auto)
        assert set(proposed.colors) == {"green", "blue"}
        assert {patch.picture for patch in proposed.patches} == {f"{n:016x}" for n in (1, 2)}
        for _ in range(3):
            await client.bus.get(topics.FRAME, 5.0, camera="left")
        assert (await ask(client, used)).error == ""


async def test_garbage_gets_an_answer_and_does_no_harm(config, tracking, seen):
    class Odd(msgspec.Struct):
        pointed: int = 3

    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        assert "Expected `array`" in (await ask(client, Odd())).error
        assert "nothing is pointed at" in (await ask(client, FitRequest())).error
        many = FitRequest(auto=True, pictures=["0" * 16])
        assert "not kept any more" in (await ask(client, many)).error
        assert "truncated" in (await ask(client, None)).error
        await seen(client, "blue", "green")
