"""The tab "Recording": record, choose a recording, replay it with a time line.

The recorder and its replay are one for all visitors, as a tape deck in the room is; the tab only
shows what it does and asks it (link.py).
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import viser

from rhot.messages.recording import RecorderRequest
from services.viewer.recording import texts
from services.viewer.recording.link import RecorderLink
from services.viewer.visits.section import Seen

# Whoever moves the time line is not to be fought over it.
_HOLD_S = 1.5


class RecordingSection:
    """One for all visitors; address is where the replay's own page is, "" while there is none."""

    title = "Recording"

    def __init__(self, link: RecorderLink, rig: str, address: Callable[[], str]) -> None:
        self._link, self._rig, self._address = link, rig, address

    def open(
        self,
        client: viser.ClientHandle,
        tab: viser.GuiTabHandle,  # noqa: ARG002
    ) -> RecordingTab:
        """Fill one visitor's tab."""
        return RecordingTab(client, self._link, self._rig, self._address)


class RecordingTab:
    """The controls of one visitor."""

    def __init__(
        self,
        client: viser.ClientHandle,
        link: RecorderLink,
        rig: str,
        address: Callable[[], str],
    ) -> None:
        gui = client.gui
        self._link, self._rig, self._address = link, rig, address
        self._loop = asyncio.get_running_loop()
        self._stop_watching = link.watch()
        self._names: dict[str, str] = {}
        self._touched_s = 0.0
        self._status = gui.add_html("")
        self._record = self._button(gui, "Record", lambda: RecorderRequest(do="record"))
        self._stop = self._button(gui, "Stop recording", lambda: RecorderRequest(do="stop"))
        self._recordings = gui.add_folder("Recordings")
        with self._recordings:
            self._choice = gui.add_dropdown("recording", (texts.NOTHING,))
            self._open = self._button(gui, "Replay", self._opened)
            self._notes = gui.add_html("")
        self._deck = gui.add_folder("Replay", visible=False)
        with self._deck:
            self._about = gui.add_html("")
            self._at = gui.add_slider("seconds", min=0.0, max=1.0, step=0.05, initial_value=0.0)
            self._play = self._button(gui, "Play", lambda: RecorderRequest(do="play"))
            self._pause = self._button(gui, "Pause", lambda: RecorderRequest(do="pause"))
            self._rate = gui.add_dropdown("speed", tuple(texts.RATES), initial_value="1")
            self._repeat = gui.add_checkbox("repeat", False)
            self._close = self._button(gui, "Close", lambda: RecorderRequest(do="close"))
        self._changed(self._at, lambda: RecorderRequest(do="set", at_s=float(self._at.value)))
        self._changed(
            self._rate, lambda: RecorderRequest(do="set", rate=texts.RATES[self._rate.value])
        )
        self._changed(
            self._repeat, lambda: RecorderRequest(do="set", loop=bool(self._repeat.value))
        )

    def _button(
        self, gui: viser.GuiApi, label: str, request: Callable[[], RecorderRequest | None]
    ) -> viser.GuiButtonHandle:
        button = gui.add_button(label)
        button.on_click(lambda _: self._ask(request()))
        return button

    def _changed(self, handle: Any, request: Callable[[], RecorderRequest]) -> None:
        def changed(event: Any) -> None:
            # Without a client it is this tab that brings it up to date.
            if event.client is not None:
                self._touched_s = time.monotonic()
                self._ask(request())

        handle.on_update(changed)

    def _ask(self, request: RecorderRequest | None) -> None:
        # In a thread of viser's.
        if request is not None:
            self._loop.call_soon_threadsafe(self._link.ask, request)

    def _opened(self) -> RecorderRequest | None:
        name = self._names.get(self._choice.value)
        return None if name is None else RecorderRequest(do="open", name=name)

    def update(self, seen: Seen) -> None:
        """Bring it up to date."""
        state = self._link.state
        _set(self._status, "content", texts.status(state, seen.now_ns, self._link.problem))
        records = state is not None and state.records
        _set(self._record, "visible", records and state is not None and not state.file)
        _set(self._stop, "visible", records and state is not None and bool(state.file))
        _set(self._recordings, "visible", records)
        self._update_choice()
        self._update_deck()

    def _update_choice(self) -> None:
        recordings = self._link.recordings
        self._names = texts.labels(recordings)
        options = tuple(self._names) or (texts.NOTHING,)
        if self._choice.options != options:
            newest = self._choice.options[0] != options[0]
            self._choice.options = options
            if newest:
                # Who has just recorded something wants to see that.
                _set(self._choice, "value", options[0])
        _set(self._open, "disabled", not self._names)
        _set(self._notes, "content", texts.notes(recordings))

    def _update_deck(self) -> None:
        replay = self._link.state.replay if self._link.state is not None else None
        _set(self._deck, "visible", replay is not None)
        if replay is None:
            return
        _set(self._about, "content", texts.replay(replay, self._rig, self._address()))
        _set(self._play, "visible", replay.state != "playing")
        _set(self._pause, "visible", replay.state == "playing")
        _set(self._at, "max", max(0.1, replay.duration_s))
        _set(self._close, "visible", self._link.state is not None and self._link.state.records)
        if time.monotonic() - self._touched_s > _HOLD_S:
            _set(self._at, "value", min(max(replay.at_s, 0.0), replay.duration_s))
            _set(self._rate, "value", texts.rate_label(replay.rate))
            _set(self._repeat, "value", replay.loop)

    def close(self) -> None:
        """The visitor has gone."""
        self._stop_watching()


def _set(handle: Any, name: str, value: object) -> None:
    """Set what differs: what is set goes to the browser."""
    if getattr(handle, name) != value:
        setattr(handle, name, value)
