"""`rhot replay FILE --view`: a recording on the page, on any machine, without a rig.

Router, page and replay for as long as the command runs. The page draws the rig that the recording
keeps: cameras, hands, shapes. The page's controls pause, jump and change the rate.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Iterable
from pathlib import Path

import msgspec

from rhot import topics
from rhot.bus.bus import Bus, open_bus
from rhot.errors import CaptureError
from rhot.files.capture import Capture
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import Bus as BusTable
from rhot.files.rig_tables import CameraTable, RigTable, Viewer
from rhot.process.event_loop import cancelled_by, stop_on_signals
from services.cli.live.router import running_router
from services.cli.live.supervisor import Child, Supervisor, service_argv
from services.cli.recorded.unpacked_capture import unpack_rig, unpacking
from services.cli.terminal import Terminal
from services.recorder.endpoints.deck import Deck
from services.recorder.endpoints.requests import Requests
from services.recorder.reader import Summary, summarize
from services.simulator.files.rig_toml import rig_toml

# The page's own name on the bus: a recording may hold health of the page that was open then.
INSTANCE = "replay"


async def view(file: Path, rate: float, loop: bool, window_ns: tuple[int, int]) -> None:
    """Show a recording until Ctrl-C; raises RhotError."""
    stopping = stop_on_signals()
    terminal = Terminal()
    with cancelled_by(stopping), unpacking(file) as folder:
        path = _unpacked(file, folder, terminal.line)
        rig = load_rig(path).rig.name
        endpoint = _free_endpoint()
        async with running_router([endpoint]), asyncio.TaskGroup() as tasks:
            options = ["--config", str(path), "--connect", endpoint, "--instance", INSTANCE]
            page = Child("viewer", service_argv("viewer", *options))
            tasks.create_task(Supervisor(terminal.log).keep_running(page))
            async with open_bus(rig, [endpoint]) as bus:
                deck = Deck(bus, rig)
                Requests(deck, None, None).answer_on(bus)
                try:
                    address = await _address(bus)
                    terminal.line(f"{file} at {address}; Ctrl-C ends it")
                    await deck.open(file, rate=rate, loop=loop, window_ns=window_ns)
                    await _show(deck, terminal)
                finally:
                    await deck.close()
                    terminal.end()


async def _address(bus: Bus) -> str:
    """Where the page is, once it is there."""
    async for beat in bus.every(topics.HEALTH, 16, service="viewer", instance=INSTANCE):
        if "port" in beat.values:
            return f"http://127.0.0.1:{beat.values['port']:.0f}"
    raise CaptureError("the page did not start")


async def _show(deck: Deck, terminal: Terminal) -> None:
    """Where the playing is, in the status line, for ever; raises CaptureError if it fails."""
    while (replay := deck.state()) is not None:
        terminal.status(f"{replay.state}, {replay.at_s:.1f} of {replay.duration_s:.1f} s")
        await asyncio.sleep(0.2)
    if deck.note:
        raise CaptureError(deck.note)


def _unpacked(file: Path, folder: Path, tell: Callable[[str], object]) -> Path:
    """The rig.toml of what the recording keeps of its rig, with notes of what is missing."""
    capture = Capture(folder / "capture")
    try:
        unpack_rig(file, capture)
        config = load_rig(capture.rig_toml)
    except CaptureError as error:
        if "config.json" not in str(error):
            raise
        tell(f"{error}: cameras and objects are shown as far as their messages tell")
        config = rig_of(summarize(file))
    # Its page and its router were its own.
    config = msgspec.structs.replace(config, viewer=Viewer(), bus=BusTable())
    for note in _missing(config, capture.folder / "calibration"):
        tell(note)
    capture.folder.mkdir(exist_ok=True)
    capture.rig_toml.write_text(rig_toml(config, f"from {file.name}"), encoding="utf-8")
    return capture.rig_toml


def rig_of(summary: Summary) -> RigConfig:
    """What the keys of a recording tell of its rig: its name and its cameras."""
    cameras = {(topics.MARKERS.names(key) or {}).get("camera", "") for key in summary.keys} - {""}
    tables = [CameraTable(name=name) for name in sorted(cameras)]
    return RigConfig(rig=RigTable(name=summary.rig or "recorded"), camera=tables)


def _missing(config: RigConfig, calibration: Path) -> Iterable[str]:
    """What of a rig's calibration the recording does not hold, and what is not drawn for that."""
    wanted = {"rig.json": "no camera is drawn"} if config.camera else {}
    wanted |= {
        f"{camera.name}.lens.json": f"camera {camera.name} is not drawn" for camera in config.camera
    }
    for name, effect in wanted.items():
        if not (calibration / name).exists():
            yield f"the recording holds no calibration/{name}: {effect}"


def _free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"
