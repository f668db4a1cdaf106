"""The controls of the calibration page, and its picture as a plane in the scene that can be
clicked, zoomed and panned.

The plane stands far away from the rig, and browsers' cameras are sent there and back: so nothing of
the rig is in the way of a click. viser calls back from threads of its own; whatever a person does
becomes an Action, handed to `tell`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from rhot.camera_messages import ColorRange
from rhot.files.config import RigConfig
from services.viewer.calibration.picture import Image

# Where the plane stands, and its height; the rig is around the origin.
_AT = np.array([0.0, 0.0, 300.0])
_HEIGHT = 1.0
# The panel floats over the right side of the window, this wide (control_width "large"); the picture
# is centred in the rest.
_PANEL_PX, _FILL = 400.0, 0.94
_JPEG_QUALITY = 90
_STEPS = {"take back": "undo", "start over": "reset", "propose all": "auto"}


@dataclass(frozen=True)
class Action:
    """What a person did: open, close, camera, color, click, undo, reset, auto, edit, masks or save;
    x, y of a click from 0 to 1.
    """

    kind: str
    x: float = 0.0
    y: float = 0.0


class CalibrateGui:
    """Folder "calibrate colours" of one viewer, shared by all who look."""

    def __init__(
        self, server: viser.ViserServer, config: RigConfig, tell: Callable[[Action], object]
    ) -> None:
        self._server, self._tell = server, tell
        self._up = (0.0, -1.0, 0.0) if config.rig.world is None else (0.0, 0.0, 1.0)
        cameras = [camera.name for camera in config.camera]
        self._plane: viser.ImageHandle | None = None
        self._ratio = 4.0 / 3.0
        gui = server.gui
        with gui.add_folder("calibrate colours", expand_by_default=False):
            self._open = gui.add_checkbox(
                "show picture",
                False,
                disabled=not cameras,
                hint="pictures are sent only while this is on",
            )
            self._camera = gui.add_dropdown("camera", tuple(cameras) or ("none",))
            self._color = gui.add_dropdown("colour", ("green",))
            self._to_do = gui.add_html("")
            self._step = gui.add_button_group(
                "clicks", tuple(_STEPS), hint="the last click, every click, no clicks"
            )
            self._report = gui.add_html("")
            self._save = gui.add_button("put in force", disabled=True)
            self._verdict = gui.add_html("")
            self._hold = gui.add_checkbox(
                "hold picture", False, hint="for hands that cannot be held still"
            )
            self._masks = gui.add_checkbox("show masks", True, hint="what each range takes")
            self._from = gui.add_slider("hue from", 0, 179, 1, 0)
            self._to = gui.add_slider(
                "hue to", 0, 179, 1, 179, hint="below 'from' it wraps through red"
            )
            self._saturation = gui.add_multi_slider("saturation", 0, 255, 1, (80, 255))
            self._value = gui.add_multi_slider("value", 0, 255, 1, (40, 255))
        self._listen()
        self._reveal()
        server.on_client_connect(self._came)

    def _listen(self) -> None:
        self._save.on_click(self._on("save"))
        for choice, kind in ((self._camera, "camera"), (self._color, "color")):
            choice.on_update(self._on(kind))
        for bound in (self._from, self._to, self._saturation, self._value):
            bound.on_update(self._on("edit"))
        self._masks.on_update(self._on("masks"))
        self._step.on_click(self._stepped)
        self._open.on_update(self._switched)

    def _reveal(self) -> None:
        """All controls while the picture is shown, its switch otherwise."""
        for handle in (
            self._camera, self._color, self._to_do, self._step, self._report, self._save, self._verdict, self._hold, self._masks,
            self._from, self._to, self._saturation, self._value,
        ):  # fmt: skip
            handle.visible = self.is_open

    @property
    def is_open(self) -> bool:
        return bool(self._open.value)

    @property
    def camera(self) -> str:
        return str(self._camera.value)

    @property
    def color(self) -> str:
        return str(self._color.value)

    @property
    def held(self) -> bool:
        return bool(self._hold.value)

    @property
    def masks(self) -> bool:
        return bool(self._masks.value)

    @property
    def span(self) -> ColorRange:
        """What the sliders say."""
        saturation, value = self._saturation.value, self._value.value
        return ColorRange(
            hsv_low=(int(self._from.value), int(saturation[0]), int(value[0])),
            hsv_high=(int(self._to.value), int(saturation[1]), int(value[1])),
        )

    def _on(self, kind: str) -> Callable[[Any], None]:
        def happened(event: Any) -> None:
            # Changes made from here come back without a client.
            if event.client is not None:
                self._tell(Action(kind))

        return happened

    def _stepped(self, event: Any) -> None:
        self._tell(Action(_STEPS[event.target.value]))

    def _switched(self, event: Any) -> None:
        self._reveal()
        if event.client is None:
            return
        for client in self._server.get_clients().values():
            self._send_there(client) if self.is_open else self._send_back(client)
        self._tell(Action("open" if self.is_open else "close"))

    async def _came(self, client: viser.ClientHandle) -> None:
        if self.is_open:
            self._send_there(client)

    def close(self) -> None:
        """Switch off, as the last one who looked has gone."""
        _set(self._open, False)
        _set(self._hold, False)

    def say(self, to_do: str, report: str, verdict: str, *, savable: bool) -> None:
        """Bring the texts up to date."""
        self._to_do.content, self._report.content, self._verdict.content = to_do, report, verdict
        self._save.disabled = not savable

    def choose(self, names: list[str], color: str, span: ColorRange) -> None:
        """Bring dropdown and sliders up to date."""
        if tuple(self._color.options) != tuple(names):
            self._color.options = tuple(names)
        if self._color.value != color:
            _set(self._color, color)
        _set(self._from, span.hsv_low[0])
        _set(self._to, span.hsv_high[0])
        _set(self._saturation, (span.hsv_low[1], max(span.hsv_low[1], span.hsv_high[1])))
        _set(self._value, (span.hsv_low[2], max(span.hsv_low[2], span.hsv_high[2])))

    def show(self, rgb: Image) -> None:
        """Show a picture (h, w, 3)."""
        ratio = rgb.shape[1] / rgb.shape[0]
        if self._plane is None or abs(ratio - self._ratio) > 1e-6:
            self.hide()
            self._ratio = ratio
            self._plane = self._server.scene.add_image(
                "/calibrate", rgb, ratio * _HEIGHT, _HEIGHT, format="jpeg", jpeg_quality=_JPEG_QUALITY, position=_AT, cast_shadow=False,
                receive_shadow=False,
            )  # fmt: skip
            self._plane.on_click(self._clicked)
            for client in self._server.get_clients().values():
                self._send_there(client)
        else:
            self._plane.image = rgb

    def hide(self) -> None:
        """Take the picture away."""
        if self._plane is not None:
            self._plane.remove()
            self._plane = None

    async def _clicked(self, event: Any) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        if abs(direction[2]) < 1e-9:
            return
        hit = origin + direction * ((_AT[2] - origin[2]) / direction[2]) - _AT
        self._tell(
            Action(
                "click",
                float(hit[0] / (self._ratio * _HEIGHT)) + 0.5,
                float(hit[1] / _HEIGHT) + 0.5,
            )
        )

    def _send_there(self, client: viser.ClientHandle) -> None:
        """A browser's camera before the picture, as large as the window allows beside the panel."""
        camera = client.camera
        width, height = (
            max(float(camera.image_width), 480.0),
            max(float(camera.image_height), 320.0),
        )
        free = max(width - _PANEL_PX, 0.4 * width)
        px_per_m = _FILL * min(height / _HEIGHT, free / (self._ratio * _HEIGHT))
        away = height / px_per_m / (2.0 * math.tan(camera.fov / 2.0))
        # The middle of what the panel leaves free is left of the window's middle.
        beside = np.array([(width - free) / 2.0 / px_per_m, 0.0, 0.0])
        with client.atomic():
            camera.up_direction = (0.0, -1.0, 0.0)
            camera.position = tuple(_AT + beside - np.array([0.0, 0.0, away]))
            camera.look_at = tuple(_AT + beside)

    def _send_back(self, client: viser.ClientHandle) -> None:
        """To where the viewer's first look was."""
        first = self._server.initial_camera
        with client.atomic():
            client.camera.up_direction = self._up
            client.camera.position = first.position
            client.camera.look_at = first.look_at


def _set(handle: Any, value: Any) -> None:
    """Set a control from here; viser's types call its value read-only."""
    handle.value = value
