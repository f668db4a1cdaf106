"""A tracker in a process of its own, under input that wants to bring it down: it keeps its rate,
its memory and its files, and every honest asker has an answer.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
import time
from pathlib import Path

import msgspec
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import client_config, open_bus
from rhot.client import RigClient
from rhot.files.calibration import load_colors, save
from rhot.messages import ClockEcho, Refusal, Session
from rhot.messages.camera import ExposureControl, FitRequest, FitResult, picture_name
from rhot.messages.simulator import SimFrame

SIZE = (640, 480)
FPS = 30.0
DEADLINE_S = 120.0
# Long enough that what piles up shows: 275 MB in 15 s before, 55 MB in three.
FLOOD_S, TRIES = 3.0, 10
RIG = f"""
[rig]
name = "desk"
[[camera]]
name = "left"
source = "simulator"
fps = {FPS}
size_px = [640, 480]
[hand.right]
markers = {{ index_tip = "green", thumb_tip = "blue" }}
"""
# Fields that nobody knows are read over, however deep they are.
NESTED = b'{"x":' + b"[" * 5000


class Tracker:
    """The process, as others see it."""

    def __init__(self, process, bus, folder):
        self.process, self.bus, self.folder = process, bus, folder
        self.client = RigClient(bus)
        self._markers = bus.every(topics.MARKERS, 64, camera="left")

    def rss_mb(self):
        """Its resident memory."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6

    async def markers(self):
        """The next frame in which both tips are found."""
        while len((await anext(self._markers)).markers) != 2:
            pass

    async def rate_hz(self, during_s):
        """Frames a second over so long."""
        began_s, count = time.monotonic(), 0
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(during_s):
                while True:
                    await anext(self._markers)
                    count += 1
        return count / (time.monotonic() - began_s)


async def film(bus, frame):
    """A camera at its rate."""
    publisher = bus.publisher(topics.SIM_FRAME, camera="left")
    for seq in range(100_000):
        frame.image[-1, -1] = seq % 256
        told = SimFrame(
            camera="left",
            seq=seq,
            stamp_ns=10**18 + round(seq * 1e9 / FPS),
            row_time_ns=1e4,
            size_px=SIZE,
            clock_skew_ns=0,
        )
        publisher.put_bytes(frame.image.tobytes(), told)
        await asyncio.sleep(1.0 / FPS)


@pytest.fixture
async def tracker(router, colors, studio, tip, tmp_path):
    """A tracker that tracks."""
    (tmp_path / "rig.toml").write_text(RIG)
    save(tmp_path / "calibration" / "left.colors.json", colors)
    tips = [
        tip("green", 70.0, 80.0, width_px=14.0, length_px=16.0),
        tip("blue", 130.0, 70.0, width_px=14.0, length_px=16.0),
    ]
    command = [sys.executable, "-m", "services.pi_tracker", "--config", "rig.toml"]
    with (tmp_path / "log").open("wb") as log:
        process = await asyncio.create_subprocess_exec(
            *command, "--camera", "left", "--connect", router, cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, stdout=log, stderr=log,
        )  # fmt: skip
    try:
        async with asyncio.timeout(DEADLINE_S), open_bus("desk", [router]) as bus:
            bus.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
            bus.answer(topics.CLOCK, lambda: ClockEcho(master_ns=time.time_ns()))
            filming = asyncio.ensure_future(film(bus, studio.frame(tips, size_px=SIZE)[0]))
            one = Tracker(process, bus, tmp_path)
            await one.markers()
            yield one
            filming.cancel()
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        await process.wait()


@contextlib.contextmanager
def flood(router, ask, hz):
    """Call ask(session) at that rate, in a process's worth of threads, until the block ends."""
    with zenoh.open(client_config([router])) as session:

        async def forever():
            due_s = time.monotonic()
            while True:
                ask(session)
                due_s += 1.0 / hz
                await asyncio.sleep(max(0.0, due_s - time.monotonic()))

        task = asyncio.ensure_future(forever())
        try:
            yield
        finally:
            task.cancel()


async def test_a_thousand_questions_a_second_for_pictures(tracker, router):
    key = topics.FRAME.key("desk", camera="left")
    # One picture asked for in peace: what an encoding takes is no growth.
    assert await tracker.bus.get(topics.FRAME, 10.0, camera="left")
    before_mb, before_hz = tracker.rss_mb(), await tracker.rate_hz(2.0)
    pictures, refusals = [], []

    def listen(reply):
        if reply.ok is not None:
            pictures.append(len(reply.ok.payload))
        elif (said := reply.err.payload.to_bytes()) != b"Timeout":
            # That is what Zenoh says where nobody had the time to answer.
            refusals.append(said)

    began_s, during_hz, peak_mb = time.monotonic(), 0.0, 0.0
    with flood(router, lambda one: one.get(key, listen, timeout=1.0), 1000.0):
        # The machine is busy with asking, too, and may be with more: it is looked at so often.
        for _ in range(TRIES):
            during_hz = max(during_hz, await tracker.rate_hz(FLOOD_S))
            peak_mb = max(peak_mb, tracker.rss_mb())
            if during_hz > 0.2 * before_hz and len(refusals) > len(pictures) > 0:
                break
    flood_s = time.monotonic() - began_s
    print(
        f"{before_mb:.0f} -> {peak_mb:.0f} MB, {before_hz:.1f} -> {during_hz:.1f} Hz, "
        f"{len(pictures)} pictures, {len(refusals)} refusals"
    )
    assert peak_mb < 1.5 * before_mb
    # Twenty pictures a second at most, each to four askers at most: no more is encoded and sent.
    assert 0 < len(pictures) < 100 * (flood_s + 1.0)
    assert len(refusals) > len(pictures)
    assert {msgspec.json.decode(one, type=Refusal).code for one in refusals} == {"busy"}
    assert during_hz > 0.2 * before_hz
    await asyncio.sleep(1.5)
    (picture,) = await tracker.bus.get(topics.FRAME, 10.0, camera="left")
    assert picture.startswith(b"\x89PNG")


def writes_of(path):
    """Counts the times that a file is replaced; looked at by its inode and time."""
    seen = set()

    def look():
        status = path.stat()
        seen.add((status.st_ino, status.st_mtime_ns))
        return len(seen)

    return look


async def test_colours_two_hundred_times_a_second(tracker, router, colors):
    path = tracker.folder / "calibration" / "left.colors.json"
    # The colours have been in use for a while.
    os.utime(path, (time.time() - 3600.0, time.time() - 3600.0))
    await asyncio.sleep(1.5)
    key = topics.COLORS.key("desk", camera="left")
    count, number, answers = writes_of(path), 0, []
    before = count()
    with zenoh.open(client_config([router])) as session:
        began_s = time.monotonic()
        # A busy machine takes longer for as many.
        while time.monotonic() < began_s + FLOOD_S or number <= 50 * FLOOD_S:
            number += 1
            made = msgspec.structs.replace(colors, date=str(number), tool="flood")
            payload = msgspec.json.encode(made)
            session.get(key, answers.append, payload=payload, timeout=10.0)
            count()
            await asyncio.sleep(0.005)
        while len(answers) < number:
            count()
            await asyncio.sleep(0.01)
        took_s = time.monotonic() - began_s
    print(f"{number} asked in {took_s:.1f} s, {count() - before} written")
    # The first at once, then one a second.
    assert 2 <= count() - before <= took_s + 4
    assert all(reply.ok is not None for reply in answers)
    # The last one wins.
    assert (await tracker.client.colors("left")).date == str(number)
    # An honest asker is answered with what holds then, and that is in the file.
    mine = msgspec.structs.replace(colors, date="mine", tool="test")
    await tracker.client.set_colors("left", mine)
    assert load_colors(path.parent, "left") == mine
    # Those that were in use for a while are kept.
    kept = msgspec.json.decode(path.with_name(f"{path.name}.bak").read_bytes())
    assert kept["date"] == colors.date
    await tracker.markers()


async def test_every_one_of_many_who_ask_at_once_is_answered(tracker, colors):
    changes = [msgspec.structs.replace(colors, date=str(n), tool="test") for n in range(20)]
    async with asyncio.timeout(60.0), asyncio.TaskGroup() as tasks:
        for change in changes:
            tasks.create_task(
                tracker.bus.request(topics.COLORS, change, timeout_s=10.0, camera="left")
            )
    assert (await tracker.client.colors("left")).date in {one.date for one in changes}


async def test_a_flood_of_fits_waits_in_a_short_queue(tracker, router):
    (picture,) = await tracker.bus.get(topics.FRAME, 10.0, camera="left")
    request = FitRequest(auto=True, pictures=[picture_name(picture)])
    before_mb = tracker.rss_mb()
    asked = [tracker.bus.get(topics.FIT, 20.0, request=request, camera="left") for _ in range(60)]
    answers: list[FitResult] = [one for found in await asyncio.gather(*asked) for one in found]
    assert len(answers) == 60
    refused = [one for one in answers if "others wait already" in one.error]
    assert len(refused) >= 40
    assert any(set(one.colors) == {"green", "blue"} for one in answers)
    assert tracker.rss_mb() < 1.5 * before_mb


async def test_rogue_answers_and_pictures_do_not_end_it(tracker, router):
    """Deeply nested JSON, wherever a tracker decodes what others send."""
    deep = json.loads("[" * 900 + "]" * 900)
    with zenoh.open(client_config([router])) as rogue:

        def answer(query):
            with query:
                query.reply(query.key_expr, NESTED)

        queryables = [
            rogue.declare_queryable(topic.key("desk"), answer)
            for topic in (topics.CLOCK, topics.SESSION)
        ]
        for payload in (NESTED, b"\xff", b"{}", b""):
            rogue.put(topics.SESSION.key("desk"), payload)
            for topic in (topics.COLORS, topics.EXPOSURE):
                rogue.put(topic.key("desk", camera="left"), payload)
            key = topics.SIM_FRAME.key("desk", camera="left")
            rogue.put(key, b"\0" * 460_800, attachment=payload)
            rogue.put(key, payload, attachment=payload)
            # Of pictures the last two are kept.
            await asyncio.sleep(0.2)
        for topic in (topics.COLORS, topics.EXPOSURE, topics.FIT):
            for payload in (NESTED, json.dumps({"colors": {}, "residuals": {"x": deep}}).encode()):
                list(rogue.get(topic.key("desk", camera="left"), payload=payload, timeout=2.0))
        # Several exchanges of the clock go by.
        await asyncio.sleep(2.5)
        for one in queryables:
            one.undeclare()
    assert tracker.process.returncode is None
    await tracker.markers()
    assert (await tracker.client.exposure("left")) == ExposureControl(
        adjustable=False, note="source 'simulator' has no exposure to set"
    )
    assert b"Traceback" not in (tracker.folder / "log").read_bytes()
