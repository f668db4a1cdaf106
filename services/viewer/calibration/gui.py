"""The controls of the calibration page, and its picture as a plane in the 3D scene that can be
clicked, zoomed and panned.

The plane is far away from the rig, and the browsers' cameras are moved there and back: so nothing
of the rig is in the way of a click. viser calls back from threads of its own; whatever a person
does becomes a UserAction, handed to `report`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import viser

from rhot.files.config import RigConfig
from rhot.messages.camera import ColorRange
from services.viewer.calibration.picture import Image

# Middle of the plane in the rig frame, and its height; the rig is around the origin.
_PLANE = np.array([0.0, 0.0, 300.0])
_HEIGHT = 1.0
# The panel floats over the right side of the window, this wide (control_width "large"); the picture
# is centred in the rest.
_PANEL_PX, _FILL = 400.0, 0.94
_JPEG_QUALITY = 90

ActionKind = Literal[
    "open", "close", "camera", "color", "click", "undo", "reset", "auto", "edit", "masks", "apply"
]
_BUTTONS: dict[str, ActionKind] = {
    "take back": "undo",
    "start over": "reset",
    "propose all": "auto",
}


@dataclass(frozen=True)
class UserAction:
    """What a person did; x, y of a click from 0 to 1."""

    kind: ActionKind
    x: float = 0.0
    y: float = 0.0


class CalibrationControls:
    """Folder "calibrate colours" of one viewer, shared by all browsers."""

    def __init__(
        self, server: viser.ViserServer, config: RigConfig, report: Callable[[UserAction], object]
    ) -> None:
        self._server, self._report_action = server, report
        self._up = (0.0, -1.0, 0.0) if config.rig.world is None else (0.0, 0.0, 1.0)
        self._plane: viser.ImageHandle | None = None
        self._aspect = 4.0 / 3.0
        with server.gui.add_folder("calibrate colours", expand_by_default=False):
            self._add_buttons(server.gui, [camera.name for camera in config.camera])
            self._add_sliders(server.gui)
        self._listen()
        self._show_or_hide()
        server.on_client_connect(self._client_connected)

    def _add_buttons(self, gui: viser.GuiApi, cameras: list[str]) -> None:
        """Everything but the sliders."""
        self._open = gui.add_checkbox(
            "show picture",
            False,
            disabled=not cameras,
            hint="pictures are sent only while this is on",
        )
        self._camera = gui.add_dropdown("camera", tuple(cameras) or ("none",))
        self._color = gui.add_dropdown("colour", ("green",))
        self._to_do = gui.add_html("")
        self._clicks = gui.add_button_group(
            "clicks", tuple(_BUTTONS), hint="the last click, every click, no clicks"
        )
        self._report = gui.add_html("")
        self._apply = gui.add_button("apply", disabled=True)
        self._status = gui.add_html("")
        self._hold = gui.add_checkbox(
            "hold picture", False, hint="for hands that cannot be held still"
        )
        self._masks = gui.add_checkbox("show masks", True, hint="what each range takes")

    def _add_sliders(self, gui: viser.GuiApi) -> None:
        """The bounds of the chosen colour's range."""
        self._from = gui.add_slider("hue from", 0, 179, 1, 0)
        self._to = gui.add_slider(
            "hue to", 0, 179, 1, 179, hint="below 'from' it wraps through red"
        )
        self._saturation = gui.add_multi_slider("saturation", 0, 255, 1, (80, 255))
        self._value = gui.add_multi_slider("value", 0, 255, 1, (40, 255))

    @property
    def _sliders(self) -> tuple[Any, ...]:
        return (self._from, self._to, self._saturation, self._value)

    def _listen(self) -> None:
        self._apply.on_click(self._reporting("apply"))
        self._camera.on_update(self._reporting("camera"))
        self._color.on_update(self._reporting("color"))
        for slider in self._sliders:
            slider.on_update(self._reporting("edit"))
        self._masks.on_update(self._reporting("masks"))
        self._clicks.on_click(self._button_pressed)
        self._open.on_update(self._switched)

    def _show_or_hide(self) -> None:
        """All controls while the picture is shown, otherwise its switch alone."""
        buttons = (self._camera, self._color, self._clicks, self._apply, self._hold, self._masks)
        texts = (self._to_do, self._report, self._status)
        for handle in (*buttons, *texts, *self._sliders):
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
        """The range that the sliders show."""
        saturation, value = self._saturation.value, self._value.value
        return ColorRange(
            hsv_low=(int(self._from.value), int(saturation[0]), int(value[0])),
            hsv_high=(int(self._to.value), int(saturation[1]), int(value[1])),
        )

    def _reporting(self, kind: ActionKind) -> Callable[[Any], None]:
        def happened(event: Any) -> None:
            # Changes made by this program come back without a client.
            if event.client is not None:
                self._report_action(UserAction(kind))

        return happened

    def _button_pressed(self, event: Any) -> None:
        self._report_action(UserAction(_BUTTONS[event.target.value]))

    def _switched(self, event: Any) -> None:
        self._show_or_hide()
        if event.client is None:
            return
        for client in self._server.get_clients().values():
            self._look_at_picture(client) if self.is_open else self._look_at_rig(client)
        self._report_action(UserAction("open" if self.is_open else "close"))

    async def _client_connected(self, client: viser.ClientHandle) -> None:
        if self.is_open:
            self._look_at_picture(client)

    def close(self) -> None:
        """Switch off, as the last browser has gone."""
        _set(self._open, False)
        _set(self._hold, False)

    def set_texts(self, to_do: str, report: str, status: str, *, can_apply: bool) -> None:
        """Bring the texts up to date."""
        self._to_do.content, self._report.content, self._status.content = to_do, report, status
        self._apply.disabled = not can_apply

    def set_color(self, names: list[str], color: str, span: ColorRange) -> None:
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
        aspect = rgb.shape[1] / rgb.shape[0]
        if self._plane is not None and abs(aspect - self._aspect) <= 1e-6:
            self._plane.image = rgb
            return
        self.hide()
        self._aspect = aspect
        self._plane = self._server.scene.add_image(
            "/calibrate",
            rgb,
            aspect * _HEIGHT,
            _HEIGHT,
            format="jpeg",
            jpeg_quality=_JPEG_QUALITY,
            position=_PLANE,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._plane.on_click(self._clicked)
        for client in self._server.get_clients().values():
            self._look_at_picture(client)

    def hide(self) -> None:
        """Take the picture away."""
        if self._plane is not None:
            self._plane.remove()
            self._plane = None

    async def _clicked(self, event: Any) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        if abs(direction[2]) < 1e-9:
            return
        hit = origin + direction * ((_PLANE[2] - origin[2]) / direction[2]) - _PLANE
        x = float(hit[0] / (self._aspect * _HEIGHT)) + 0.5
        y = float(hit[1] / _HEIGHT) + 0.5
        self._report_action(UserAction("click", x, y))

    def _look_at_picture(self, client: viser.ClientHandle) -> None:
        """Move a browser's camera in front of the picture, as large as fits beside the panel."""
        camera = client.camera
        width = max(float(camera.image_width), 480.0)
        height = max(float(camera.image_height), 320.0)
        free = max(width - _PANEL_PX, 0.4 * width)
        px_per_m = _FILL * min(height / _HEIGHT, free / (self._aspect * _HEIGHT))
        distance = height / px_per_m / (2.0 * math.tan(camera.fov / 2.0))
        # The middle of what the panel leaves free is left of the window's middle.
        aside = np.array([(width - free) / 2.0 / px_per_m, 0.0, 0.0])
        with client.atomic():
            camera.up_direction = (0.0, -1.0, 0.0)
            camera.position = tuple(_PLANE + aside - np.array([0.0, 0.0, distance]))
            camera.look_at = tuple(_PLANE + aside)

    def _look_at_rig(self, client: viser.ClientHandle) -> None:
        """Move a browser's camera back to where it was at first."""
        first = self._server.initial_camera
        with client.atomic():
            client.camera.up_direction = self._up
            client.camera.position = first.position
            client.camera.look_at = first.look_at


def _set(handle: Any, value: Any) -> None:
    """Set a control from here; viser's types call its value read-only."""
    handle.value = value
