"""Which source a word in rig.toml means, and readers in a thread as asynchronous sources."""

from __future__ import annotations

import asyncio
import threading

import msgspec
import numpy as np
import pytest

from rhot import clock, topics
from rhot.bus.bus import open_bus
from rhot.errors import ConfigError, SourceError
from rhot.files.calibration import Exposure, save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable
from rhot.messages.simulator import SimFrame
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.sources import ThreadedSource, is_file, open_reader
from services.pi_tracker.sources.notes import Notes
from services.pi_tracker.sources.simulator import SimulatorSource

DEADLINE_S = 60.0


@pytest.mark.parametrize(
    ("source", "kind", "file"),
    [
        ("picamera2", "PiCamera", False),
        ("picamera2:1", "PiCamera", False),
        ("v4l2:0", "OpenCvCamera", False),
        ("v4l2:/dev/video2", "OpenCvCamera", False),
        ("gstreamer:videotestsrc ! appsink", "OpenCvCamera", False),
        ("video:a.mp4", "VideoReader", True),
        ("folder:.", "FolderReader", True),
        ("capture:.", "CaptureReader", True),
    ],
)
def test_each_word_has_its_reader(tmp_path, source, kind, file):
    table = CameraTable(name="left", source=source)
    assert type(open_reader(table, RigConfig(folder=str(tmp_path)))).__name__ == kind
    assert is_file(table) is file


@pytest.mark.parametrize(
    "source",
    ["", "webcam", "video:", "picamera2:one", "v4l2", "capture", "simulator", "Video:a.mp4"],
)
def test_an_unknown_word_is_answered_with_the_list(source):
    with pytest.raises(
        ConfigError,
        match=r"camera 'left': unknown source .* valid: picamera2, .*capture:DIR, simulator",
    ):
        open_reader(CameraTable(name="left", source=source), RigConfig())


def test_a_camera_takes_its_exposure_from_the_calibration(tmp_path):
    save(
        tmp_path / "calibration" / "left.exposure.json",
        Exposure(exposure_us=5000.0, gain=1.0, red_gain=1.0, blue_gain=1.0),
    )
    reader = open_reader(
        CameraTable(name="left", source="picamera2"), RigConfig(folder=str(tmp_path))
    )
    assert reader._exposure.exposure_us == 5000.0


def frame(seq, stamp_ns=0):
    return Frame("left", seq, stamp_ns, 0.0, (2, 2), np.zeros((2, 2, 3), np.uint8), "bgr")


class Scripted:
    """A reader that hands out frames as it is allowed to."""

    def __init__(self, frames, *, live, error=None, pause_after=0):
        self.live = live
        self.notes = Notes("left")
        self.frames = list(frames)
        self.error = error
        self.pause_after = pause_after
        self.reads = 0
        self.closed = threading.Event()
        self.go = threading.Event()
        self.go.set()

    def open(self):
        if self.error and not self.frames:
            raise self.error

    def read(self):
        self.go.wait(DEADLINE_S)
        self.reads += 1
        if self.reads == self.pause_after:
            self.go.clear()
        if self.frames:
            return self.frames.pop(0)
        if self.error:
            raise self.error
        return None

    def close(self):
        self.closed.set()


async def collect(source):
    async with asyncio.timeout(DEADLINE_S):
        return [one.seq async for one in source.frames()]


async def test_every_frame_of_a_file_comes_and_no_more_are_read_than_needed():
    reader = Scripted((frame(n) for n in range(50)), live=False)
    source = ThreadedSource(reader)
    seen = []
    async with asyncio.timeout(DEADLINE_S):
        async for one in source.frames():
            seen.append(one.seq)
            assert reader.reads <= len(seen) + 5
            await asyncio.sleep(0)
    assert seen == list(range(50))
    assert source.dropped == 0
    assert reader.closed.is_set()


async def test_the_latest_frame_of_a_camera_wins():
    reader = Scripted((frame(n) for n in range(20)), live=True, pause_after=1)
    source = ThreadedSource(reader)
    stream = source.frames()
    async with asyncio.timeout(DEADLINE_S):
        assert (await anext(stream)).seq == 0
        reader.go.set()
        while not reader.closed.is_set():
            await asyncio.sleep(0.005)
        assert [one.seq async for one in stream] == [19]
    assert source.dropped == 18


async def test_a_file_can_be_played_in_real_time():
    frames = [frame(n, 5_000_000_000 + n * 30_000_000) for n in range(4)]
    started_ns = clock.now_ns()
    assert await collect(ThreadedSource(Scripted(frames, live=False), real_time=True)) == [
        0,
        1,
        2,
        3,
    ]
    assert clock.now_ns() - started_ns >= 85_000_000


@pytest.mark.parametrize("frames", [0, 3])
async def test_what_a_reader_raises_comes_out_of_the_stream(frames):
    reader = Scripted((frame(n) for n in range(frames)), live=False, error=SourceError("unplugged"))
    stream = ThreadedSource(reader).frames()
    assert [(await anext(stream)).seq for _ in range(frames)] == list(range(frames))
    with pytest.raises(SourceError, match="unplugged"):
        await anext(stream)


async def test_leaving_the_stream_closes_the_reader():
    reader = Scripted((frame(n) for n in range(1000)), live=True)
    stream = ThreadedSource(reader).frames()
    async with asyncio.timeout(DEADLINE_S):
        await anext(stream)
        await stream.aclose()
    assert reader.closed.is_set()


def attachment(**fields):
    values = {
        "camera": "left",
        "seq": 4,
        "stamp_ns": 99,
        "row_time_ns": 30e3,
        "size_px": (8, 4),
        "clock_skew_ns": 2_000_000_000,
    }
    return SimFrame(**{**values, **fields})


async def test_simulated_frames_come_over_the_bus_and_nonsense_is_counted(router):
    image = np.arange(48, dtype=np.uint8)
    async with open_bus("test", [router]) as sender, open_bus("test", [router]) as receiver:
        source = SimulatorSource(receiver, "left")
        stream = source.frames()
        waiting = asyncio.create_task(anext(stream))
        publisher = sender.publisher(topics.SIM_FRAME, camera="left")
        async with asyncio.timeout(DEADLINE_S):
            while not publisher.wanted:
                await asyncio.sleep(0.01)
            bad = [
                (b"garbage", attachment()),
                (image.tobytes(), attachment(size_px=(800, 400))),
                (image.tobytes(), attachment(size_px=(-8, -4))),
                (image.tobytes(), attachment(size_px=(3, 16))),
                (image.tobytes(), attachment(camera="right")),
                (image.tobytes(), attachment(row_time_ns=1e300)),
                (image.tobytes(), None),
            ]
            for number, (payload, told) in enumerate(bad, start=1):
                publisher.put_bytes(payload, told)
                while source.rejected < number:
                    await asyncio.sleep(0.005)
            publisher.put_bytes(image.tobytes(), attachment())
            taken = await waiting
            publisher.put_bytes(image.tobytes(), attachment(full_range=True))
            wide = await anext(stream)
    assert (taken.full_range, wide.full_range) == (False, True)
    assert (taken.seq, taken.stamp_ns, taken.row_time_ns, taken.size_px, taken.layout) == (
        4,
        99,
        30e3,
        (8, 4),
        "i420",
    )
    assert np.array_equal(taken.image.ravel(), image)
    assert source.now_ns() - clock.now_ns() == pytest.approx(2e9, abs=1e8)
    assert msgspec.json.decode(msgspec.json.encode(attachment()), type=SimFrame) == attachment()
