"""The panel beside the 3D scene: switches, texts and camera pictures.

Its texts are made in services/viewer/live/panels.py.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence

import viser

from rhot.files.config import RigConfig
from rhot.hand import HandName
from rhot.watch.rig_state import StandingFault
from services.viewer.live import fault_panel, panels
from services.viewer.live.model import View

# JPEG files begin with this; other bytes are not sent to a browser.
_JPEG = b"\xff\xd8\xff"


class LivePanel:
    """Switches and texts of one viewer, shared by all browsers."""

    def __init__(self, server: viser.ViserServer, config: RigConfig, notes: Sequence[str]) -> None:
        gui = server.gui
        self._config = config
        self._notes = notes
        # Above everything else, and not there while all is well.
        self._faults = gui.add_html("", visible=False)
        self._status = gui.add_html(panels.status(config, _NOTHING, notes))
        gui.add_html(panels.legend())
        self._trails = gui.add_checkbox("finger trails", False)
        self._pictures = gui.add_checkbox(
            "camera pictures",
            False,
            disabled=not config.camera,
            hint="cameras send pictures only while this is on",
        )
        self._previews: dict[str, viser.GuiHtmlHandle] = {
            camera.name: gui.add_html(panels.preview(camera.name, None), visible=False)
            for camera in config.camera
        }
        self._angles: dict[HandName, viser.GuiHtmlHandle] = {}
        for hand in config.hand:
            with gui.add_folder(f"{hand} hand, degrees"):
                self._angles[hand] = gui.add_html("")
        with gui.add_folder("rates", expand_by_default=False):
            self._rates = gui.add_html(panels.rates([]))

    @property
    def trails(self) -> bool:
        """Whether trails are switched on."""
        return bool(self._trails.value)

    @property
    def pictures(self) -> bool:
        """Whether camera pictures are switched on."""
        return bool(self._pictures.value)

    def show(self, view: View, faults: Sequence[StandingFault] = (), now_ns: int = 0) -> None:
        """Bring the texts up to date; now_ns is CLOCK_REALTIME."""
        self._faults.visible = bool(faults)
        self._faults.content = fault_panel.faults(faults, now_ns)
        self._status.content = panels.status(self._config, view, self._notes)
        self._rates.content = panels.rates(view.health)
        for hand, handle in self._angles.items():
            handle.content = (
                panels.angles(view.hands[hand].pose) if hand in view.hands else panels.no_angles()
            )

    def show_pictures(self, visible: bool) -> None:
        """Show the pictures, or hide and forget them."""
        for camera, handle in self._previews.items():
            handle.visible = visible
            if not visible:
                handle.content = panels.preview(camera, None)

    def set_picture(self, camera: str, jpeg: bytes) -> bool:
        """Show one camera's picture; false if it is no JPEG, or of no camera of this rig."""
        if camera not in self._previews or not jpeg.startswith(_JPEG):
            return False
        self._previews[camera].content = panels.preview(camera, base64.b64encode(jpeg).decode())
        return True


_NOTHING = View(hands={}, points={}, objects={}, trails={}, health=[], latency_ms={})
