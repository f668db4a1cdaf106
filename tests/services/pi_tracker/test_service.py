"""The process: waits for the start, tracks what comes, shows pictures to who asks."""

from __future__ import annotations

import asyncio
import contextlib

import cv2
import msgspec
import numpy as np
import pytest
import zenoh

from rhot import topics
from rhot.bus.bus import Bus, client_config, open_bus
from rhot.errors import CalibrationError, CaptureError, ConfigError
from rhot.files.calibration import save
from rhot.files.config import RigConfig
from rhot.files.rig_tables import CameraTable, HandTable, ObjectTable, RigTable
from rhot.messages import Session
from rhot.messages.camera import SeenInPicture
from rhot.messages.simulator import SimFrame
from rhot.process.service import Service
from services.pi_tracker.endpoints import preview
from services.pi_tracker.service import serve

DEADLINE_S = 60.0
SIZE = (160, 120)
FOLDER = CameraTable(name="left", source="folder:shots")


@pytest.fixture
def config(tmp_path, colors):
    """A rig of one simulated camera that looks for green, and for the blue on a cup's tracker."""
    save(tmp_path / "calibration" / "left.colors.json", colors)
    return RigConfig(
        rig=RigTable(name="test"),
        camera=[CameraTable(name="left", source="simulator", size_px=SIZE)],
        hand={"right": HandTable(markers={"index_tip": "green"})},
        object=[ObjectTable(name="cup", serial="LHR-1", marker="blue")],
        folder=str(tmp_path),
    )


@contextlib.asynccontextmanager
async def running(config, router, camera="left"):
    """The service in this loop; yields it."""
    async with open_bus("test", [router]) as bus, asyncio.TaskGroup() as tasks:
        service = Service("pi_tracker", camera, config, bus, tasks)
        task = tasks.create_task(serve(service))
        yield service
        task.cancel()


class Rig:
    """The rest of the rig, as the tracker sees it: a camera, a master."""

    def __init__(self, bus: Bus, frame):
        self._bus = bus
        self._frame = frame
        self._camera = bus.publisher(topics.SIM_FRAME, camera="left")
        self._sessions = bus.publisher(topics.SESSION)
        self._seq = 0

    async def camera_wanted(self):
        while not self._camera.wanted:
            await asyncio.sleep(0.01)

    async def say(self, *, running):
        while not self._sessions.wanted:
            await asyncio.sleep(0.01)
        self._sessions.put(Session(running=running, start_ns=1))

    def shoot(self):
        """Send one frame, unlike the last as a camera's are; its number."""
        self._seq += 1
        self._frame.image[-1, -1] = self._seq % 256
        told = SimFrame(
            camera="left",
            seq=self._seq,
            stamp_ns=10**18 + self._seq,
            row_time_ns=1e4,
            size_px=SIZE,
            clock_skew_ns=0,
        )
        self._camera.put_bytes(self._frame.image.tobytes(), told)
        return self._seq

    async def until_seen(self, markers):
        """Shoot until a MarkerFrame comes back."""
        task = asyncio.ensure_future(anext(markers))
        while not task.done():
            self.shoot()
            await asyncio.wait([task], timeout=0.05)
        return task.result()


@pytest.fixture
async def rig(router, studio, tip):
    """A rig that shows a green and a blue tip."""
    frame, _ = studio.frame([tip("green", 50.0, 60.0), tip("blue", 80.0, 50.0)], size_px=SIZE)
    async with open_bus("test", [router]) as bus:
        yield Rig(bus, frame)


async def test_it_waits_for_the_start_and_pauses_at_the_stop(config, router, rig):
    async with (
        asyncio.timeout(DEADLINE_S),
        open_bus("test", [router]) as other,
        running(config, router) as service,
    ):
        markers = other.every(topics.MARKERS, 64)
        await rig.camera_wanted()
        for _ in range(5):
            rig.shoot()
            await asyncio.sleep(0.01)
        assert service.state == "waiting"
        await rig.say(running=True)
        first = await rig.until_seen(markers)
        assert first.seq > 5
        assert {marker.color for marker in first.markers} == {"green", "blue"}
        assert service.state == "running"
        await rig.say(running=False)
        while service.state == "running":
            rig.shoot()
            await asyncio.sleep(0.02)
        assert service.values["markers"] == 1.0  # the hand's; the cup's paint turns away at times
        assert {"search_ms", "centroid_ms", "step_ms", "skipped_frames"} <= set(service.values)


async def test_after_a_restart_it_asks_and_carries_on(config, router, rig):
    async with asyncio.timeout(DEADLINE_S), open_bus("test", [router]) as master:
        master.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
        for _ in range(2):
            async with running(config, router):
                markers = master.every(topics.MARKERS, 64)
                await rig.camera_wanted()
                assert (await rig.until_seen(markers)).camera == "left"
                markers.undeclare()


async def test_frames_without_markers_are_published_too(config, router, rig, studio):
    rig._frame = studio.frame([], size_px=SIZE)[0]
    async with (
        asyncio.timeout(DEADLINE_S),
        open_bus("test", [router]) as master,
        running(config, router),
    ):
        master.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
        markers = master.every(topics.MARKERS, 64)
        await rig.camera_wanted()
        assert (await rig.until_seen(markers)).markers == []


async def test_pictures_for_who_asks(config, router, rig):
    async with (
        asyncio.timeout(DEADLINE_S),
        open_bus("test", [router]) as other,
        running(config, router),
    ):
        await rig.camera_wanted()
        assert await other.get(topics.FRAME, 0.3, camera="left") == []
        previews = other.raw(topics.PREVIEW, 4, camera="left")
        task = asyncio.ensure_future(anext(previews))
        while not task.done():
            rig.shoot()
            await asyncio.wait([task], timeout=0.05)
        shown = cv2.imdecode(np.frombuffer(task.result().payload, np.uint8), cv2.IMREAD_COLOR)
        assert shown.shape == (SIZE[1], SIZE[0], 3)
        assert task.result().attachment == b"", "without a session nothing is looked for"
        (lossless,) = await other.get(topics.FRAME, 2.0, camera="left")
        picture = cv2.imdecode(np.frombuffer(lossless, np.uint8), cv2.IMREAD_COLOR)
        assert np.array_equal(picture, cv2.cvtColor(rig._frame.image, cv2.COLOR_YUV2BGR_I420))


async def test_who_subscribes_to_everything_gets_json_and_makes_nobody_encode(
    config, router, rig, monkeypatch
):
    encoded = []
    monkeypatch.setattr(preview, "jpeg", lambda frame: encoded.append(frame.seq) or b"jpeg")
    with zenoh.open(client_config([router])) as session:
        heard = []
        everything = session.declare_subscriber(
            "rhot/**", lambda one: heard.append((str(one.key_expr), one.payload.to_bytes()))
        )
        async with (
            asyncio.timeout(DEADLINE_S),
            open_bus("test", [router]) as master,
            running(config, router) as service,
        ):
            master.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
            beat = service.tasks.create_task(service.beat())
            await rig.camera_wanted()
            while not any(key.endswith("/markers") for key, _ in heard) or not any(
                key.endswith("/health") for key, _ in heard
            ):
                rig.shoot()
                await asyncio.sleep(0.05)
            assert encoded == []
            assert all(msgspec.json.decode(payload) for _, payload in heard)
            # The picture is there for who asks for it by name.
            pictures = master.raw(topics.PREVIEW, 4)
            task = asyncio.ensure_future(anext(pictures))
            while not task.done():
                rig.shoot()
                await asyncio.wait([task], timeout=0.05)
            assert task.result().key == "rhot-picture/test/camera/left/preview"
            seen = msgspec.json.decode(task.result().attachment, type=SeenInPicture)
            assert seen.size_px == SIZE
            assert {one.color for one in seen.markers} <= set(seen.looked_for) == {"green", "blue"}
            assert encoded
            beat.cancel()
        everything.undeclare()


async def test_new_colours_need_no_restart(config, router, rig, colors, tmp_path):
    path = tmp_path / "calibration" / "left.colors.json"
    async with (
        asyncio.timeout(DEADLINE_S),
        open_bus("test", [router]) as master,
        running(config, router) as service,
    ):
        master.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
        markers = master.latest(topics.MARKERS)
        await rig.camera_wanted()
        await rig.until_seen(markers)
        path.write_text("{broken")
        while "left.colors.json" not in service.last_error:
            await asyncio.sleep(0.05)
        assert len((await rig.until_seen(markers)).markers) == 2
        ranges = {**colors.colors, "green": colors.colors["magenta"]}
        save(path, type(colors)(colors=ranges))
        while len((await rig.until_seen(markers)).markers) != 1:
            pass


async def test_a_recording_begins_with_the_session_and_ends_the_service(
    config, router, studio, tip, tmp_path
):
    (tmp_path / "shots").mkdir()
    for seq in range(3):
        clean, _ = studio.clean([tip("green", 50.0, 60.0)], size_px=SIZE)
        cv2.imwrite(str(tmp_path / "shots" / f"{seq}.png"), studio.bgr(clean, 3.0, seq))
    config = msgspec.structs.replace(
        config, camera=[CameraTable(name="left", source="folder:shots", size_px=SIZE)]
    )
    async with asyncio.timeout(DEADLINE_S), open_bus("test", [router]) as master:
        markers = master.every(topics.MARKERS, 64)
        master.answer(topics.SESSION, lambda: Session(running=True, start_ns=7_000_000_000))
        async with open_bus("test", [router]) as bus, asyncio.TaskGroup() as tasks:
            await serve(Service("pi_tracker", "left", config, bus, tasks))
        found = [await anext(markers) for _ in range(3)]
    assert [one.stamp_ns for one in found] == [
        7_000_000_000 + round(n * 1e9 / 30.0) for n in range(3)
    ]
    assert all([marker.color for marker in one.markers] == ["green"] for one in found)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (
            {"camera": [CameraTable(name="left", source="folder:nowhere")]},
            CaptureError,
            "no such folder of images",
        ),
        (
            {"camera": [CameraTable(name="left", source="kinect")]},
            ConfigError,
            "unknown source 'kinect'",
        ),
        ({"camera": [CameraTable(name="other")]}, ConfigError, "has no camera 'left'; it has"),
        # A live camera would start, to be calibrated over the bus; a recording cannot be.
        (
            {"hand": {"right": HandTable(markers={"index_tip": "mauve"})}, "camera": [FOLDER]},
            CalibrationError,
            "colour 'mauve'",
        ),
        (
            {"folder": "/nowhere", "camera": [FOLDER]},
            CalibrationError,
            "rhot calibrate colors left",
        ),
    ],
)
async def test_what_is_wrong_ends_it_with_a_reason(config, router, change, error, message):
    spoilt = msgspec.structs.replace(config, **change)
    async with asyncio.timeout(DEADLINE_S), open_bus("test", [router]) as master:
        master.answer(topics.SESSION, lambda: Session(running=True, start_ns=1))
        with pytest.raises(BaseExceptionGroup) as caught:
            async with open_bus("test", [router]) as bus, asyncio.TaskGroup() as tasks:
                await serve(Service("pi_tracker", "left", spoilt, bus, tasks))
        assert caught.value.subgroup(error) is not None
        assert message in str(caught.value.subgroup(error).exceptions[0])
