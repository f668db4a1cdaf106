"""Colour ranges over the bus, without a restart."""

from __future__ import annotations

import asyncio
import contextlib
import json

import msgspec
import pytest

from rhot import topics
from rhot.errors import BusError, RefusedError
from rhot.files.calibration import ColorRange, Colors, load_colors
from rhot.messages import Refusal

NOTHING = ColorRange(hsv_low=(150, 250, 250), hsv_high=(151, 255, 255))


async def refused(service, count):
    while service.values["colors_refused"] < count:
        await asyncio.sleep(0.02)


async def test_a_put_takes_effect_and_is_written_and_told(config, tracking, seen, colors, tmp_path):
    async with tracking(config) as (service, client):
        await seen(client, "blue", "green")
        assert await client.colors("left") == colors
        made = Colors(
            date="2026-01-02T03:04:05",
            tool="test",
            residuals={"x": 1},
            colors={**colors.colors, "green": NOTHING},
        )
        await client.set_colors("left", made)
        await seen(client, "blue")
        assert await client.colors("left") == made
        assert load_colors(tmp_path / "calibration", "left") == made
        assert [path.name for path in (tmp_path / "calibration").iterdir()] == ["left.colors.json"]
        assert service.errors == 0


async def test_the_file_itself_can_be_put_by_any_tool(config, tracking, seen, colors):
    """As `zenoh put` does: bytes on the key."""
    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        text = json.dumps(
            {
                "colors": {
                    name: msgspec.to_builtins(span)
                    for name, span in {**colors.colors, "blue": NOTHING}.items()
                }
            }
        )
        client.bus.put_raw(topics.COLORS.key("desk", camera="left"), text.encode())
        await seen(client, "green")
        # Who says nothing of the date gets one.
        assert (await client.colors("left")).date


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"green": None}, "'green' of rig.toml's markers, which is tracked, would be lost"),
        (
            {"green": ColorRange(hsv_low=(0, 200, 0), hsv_high=(10, 100, 255))},
            "lowest saturation, 200, is above its highest",
        ),
    ],
)
async def test_what_cannot_be_is_refused_with_the_reason(
    config, tracking, seen, colors, change, words
):
    async with tracking(config) as (service, client):
        await seen(client, "blue", "green")
        ranges = {
            name: span for name, span in {**colors.colors, **change}.items() if span is not None
        }
        with pytest.raises(RefusedError, match=words) as caught:
            await client.set_colors("left", Colors(date="d", tool="t", colors=ranges))
        assert caught.value.code == "invalid"
        assert "of d by t for camera 'left' are refused" in str(caught.value)
        # Who asked has been told: health is for what nobody hears of.
        assert service.errors == 0
        assert service.values["colors_refused"] == 1
        assert await client.colors("left") == colors
        await seen(client, "blue", "green")


async def test_what_was_wrong_is_no_longer_said_once_other_colours_are_used(
    config, tracking, seen, colors
):
    async with tracking(config) as (service, client):
        await seen(client, "blue", "green")
        bad = Colors(date="d", tool="t", colors={"green": NOTHING})
        client.bus.put_raw(topics.COLORS.key("desk", camera="left"), msgspec.json.encode(bad))
        await refused(service, 1)
        assert "of d by t for camera 'left' are refused" in service.last_error
        (fault,) = [one for one in service.faults.standing() if one.code == "request_refused"]
        assert fault.subject == "left colors"
        await client.set_colors("left", Colors(date="e", tool="t", colors=colors.colors))
        assert service.last_error == ""
        service.error("something else")
        await client.set_colors("left", Colors(date="f", tool="t", colors=colors.colors))
        assert service.last_error == "something else"


GARBAGE = [
    b"",
    b"{}",
    b"\xff\xfe",
    b"[" * 30_000,
    b'{"colors":{"green":{"hsv_low":[180,0,0],"hsv_high":[10,255,255]}}}',
    b'{"colors":{"green":{"hsv_low":[0,0,0],"hsv_high":[10,256,255]}}}',
    b'{"colors":{"green":{"hsv_low":[0,-1,0],"hsv_high":[10,255,255]}}}',
    b'{"colors":{"green":{"hsv_low":[0.5,1,0],"hsv_high":[10,255,255]}}}',
    b'{"colors":{"gr een":{"hsv_low":[0,1,0],"hsv_high":[10,255,255]}}}',
]


async def test_garbage_is_refused_counted_and_does_no_harm(config, tracking, seen, colors):
    async with tracking(config) as (service, client):
        await seen(client, "blue", "green")
        for payload in GARBAGE:
            before = service.values["colors_refused"]
            # A put may be dropped on a busy machine: it is sent again until it has been heard.
            while service.values["colors_refused"] == before:
                client.bus.put_raw(topics.COLORS.key("desk", camera="left"), payload)
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(refused(service, before + 1), 2.0)
            assert "are refused" in service.last_error
        assert service.errors == service.values["colors_refused"] >= len(GARBAGE)
        assert await client.colors("left") == colors
        await seen(client, "blue", "green")


async def test_garbage_in_a_request_is_refused_with_a_typed_reply(config, tracking, seen, colors):
    """As a query of any Zenoh tool with a payload: the error reply is a Refusal."""
    async with tracking(config) as (service, client):
        await seen(client, "blue", "green")
        key = topics.COLORS.key("desk", camera="left")
        session = client.bus._session
        # An empty payload is a plain question.
        for payload in GARBAGE[1:]:
            (reply,) = await asyncio.to_thread(lambda p=payload: list(session.get(key, payload=p)))
            refusal = msgspec.json.decode(reply.err.payload.to_bytes(), type=Refusal)
            assert refusal.code in ("malformed", "invalid")
            assert "are refused" in refusal.reason
            assert str(reply.err.encoding) == "application/json;rhot.Refusal.1"
        assert service.values["colors_refused"] == len(GARBAGE) - 1
        assert service.errors == 0
        assert await client.colors("left") == colors


async def test_a_file_that_cannot_be_written_keeps_the_old(
    config, tracking, seen, colors, monkeypatch
):
    def full(path, calibration):
        raise OSError(28, "No space left on device")

    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        monkeypatch.setattr("services.pi_tracker.endpoints.color_ranges.write_setting", full)
        with pytest.raises(RefusedError, match=r"cannot be written.*No space left") as caught:
            await client.set_colors(
                "left", Colors(date="d", tool="t", colors={**colors.colors, "green": NOTHING})
            )
        assert caught.value.code == "not_saved"
        await seen(client, "blue", "green")
        assert await client.colors("left") == colors


@pytest.mark.parametrize("spoil", ["missing", "incomplete", "broken"])
async def test_a_live_camera_starts_uncalibrated_and_is_calibrated_over_the_bus(
    config, tracking, seen, colors, tmp_path, spoil
):
    path = tmp_path / "calibration" / "left.colors.json"
    match spoil:
        case "missing":
            path.unlink()
        case "incomplete":
            path.write_bytes(msgspec.json.encode(Colors(colors={"green": colors.colors["green"]})))
        case "broken":
            path.write_text("{")
    async with tracking(config) as (service, client):
        await seen(client, *(["green"] if spoil == "incomplete" else []))
        assert "rhot calibrate colors" in service.last_error
        await client.set_colors("left", msgspec.structs.replace(colors, date="now", tool="t"))
        await seen(client, "blue", "green")
        assert load_colors(tmp_path / "calibration", "left").colors == colors.colors


async def test_drift_is_told_in_health_and_not_followed(config, tracking, seen, colors):
    async with tracking(config) as (service, client):
        await seen(client, "blue", "green")
        green = colors.colors["green"]
        # As if the light had turned: the range ends in the middle of the marker's hues.
        low, high = green.hsv_low, green.hsv_high
        turned = ColorRange(hsv_low=(low[0] + 8, *low[1:]), hsv_high=(high[0] + 8, *high[1:]))
        await client.set_colors(
            "left", Colors(date="d", tool="t", colors={**colors.colors, "green": turned})
        )
        while "has drifted" not in service.last_error:
            await asyncio.sleep(0.02)
        assert "'green'" in service.last_error
        assert "Range that fits now" in service.last_error
        assert service.values["green_outside"] >= 0.0
        assert abs(service.values["green_hue_off"]) > 0.5
        assert (await client.colors("left")).colors["green"] == turned
        errors = service.errors
        await client.set_colors("left", Colors(date="e", tool="t", colors=colors.colors))
        assert "green_hue_off" not in service.values or abs(service.values["green_hue_off"]) < 0.5
        assert "color_drifted" not in {fault.code for fault in service.faults.standing()}
        assert service.errors == errors


async def test_a_camera_that_is_not_there_is_said_to_be_missing(config, tracking, seen, colors):
    async with tracking(config) as (_, client):
        await seen(client, "blue", "green")
        for asked in (
            client.colors("nobody"),
            client.set_colors("nobody", colors),
            client.exposure("nobody"),
        ):
            with pytest.raises(BusError, match="no tracker of camera 'nobody' answers"):
                await asked


async def test_colours_may_come_one_after_the_other(config, tracking, seen, colors, tmp_path):
    (tmp_path / "calibration" / "left.colors.json").unlink()
    async with tracking(config) as (service, client):
        await seen(client)
        green = Colors(date="1", tool="t", colors={"green": colors.colors["green"]})
        await client.set_colors("left", green)
        assert "blue (the right hand's thumb tip) not calibrated yet" in service.last_error
        await seen(client, "green")
        await client.set_colors(
            "left",
            Colors(date="2", tool="t", colors={**green.colors, "blue": colors.colors["blue"]}),
        )
        await seen(client, "blue", "green")
