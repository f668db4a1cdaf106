"""The controls of the colours' calibration for one visitor, and the picture that is clicked.

The picture is the background of the visitor's view: flat, whichever way the view is turned. The
visitor's camera is far away from the rig meanwhile, so that nothing of it is in the way of a click.
viser calls back from threads of its own; whatever a person does becomes a UserAction, handed to
`report`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import viser

from rhot.files.config import RigConfig
from rhot.messages.camera import ColorRange
from services.viewer.calibration.picture import Image
from services.viewer.calibration.placing import Place, placed

# Where a visitor looks from and to while he sees a picture: the rig, around the origin, is behind
# the horizon.
_AWAY, _LOOK_AT = (0.0, 0.0, 998.0), (0.0, 0.0, 1000.0)
_JPEG_QUALITY = 90

ActionKind = Literal["camera", "color", "click", "undo", "reset", "auto", "edit", "masks", "apply"]
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
    """Camera, colour, texts, buttons and sliders; hidden until they are shown."""

    def __init__(
        self, client: viser.ClientHandle, config: RigConfig, report: Callable[[UserAction], object]
    ) -> None:
        self._client, self._report_action = client, report
        self.is_open = False
        self._place: Place | None = None
        # Where the visitor looked from before.
        self._before: tuple[Any, Any, Any] | None = None
        self._add_buttons(client.gui, [camera.name for camera in config.camera])
        self._add_sliders(client.gui)
        self._listen()
        self._show_or_hide()

    def _add_buttons(self, gui: viser.GuiApi, cameras: list[str]) -> None:
        """Everything but the sliders."""
        self._camera = gui.add_dropdown("camera", tuple(cameras) or ("none",))
        self._color = gui.add_dropdown("colour", ("green",))
        self._to_do = gui.add_html("")
        self._clicks = gui.add_button_group(
            "clicks",
            tuple(_BUTTONS),
            hint="forget the last click, forget all, or find paint by what moves",
        )
        self._report = gui.add_html("")
        self._apply = gui.add_button("apply", disabled=True, color="green")
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
        self._client.scene.on_click()(self._clicked)

    def _show_or_hide(self) -> None:
        """All controls, or none."""
        buttons = (self._camera, self._color, self._clicks, self._apply, self._hold, self._masks)
        texts = (self._to_do, self._report, self._status)
        for handle in (*buttons, *texts, *self._sliders):
            handle.visible = self.is_open

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

    def open(self) -> None:
        """Show the controls; the picture follows."""
        self.is_open = True
        self._show_or_hide()
        camera = self._client.camera
        self._before = (camera.up_direction, camera.position, camera.look_at)
        with self._client.atomic():
            camera.position, camera.look_at = _AWAY, _LOOK_AT

    def close(self) -> None:
        """Hide everything, and bring the visitor back to where he was."""
        self.is_open = False
        self._show_or_hide()
        self.hide()
        if self._before is not None:
            camera = self._client.camera
            with self._client.atomic():
                camera.up_direction, camera.position, camera.look_at = self._before
            self._before = None

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
        """Show a picture (h, w, 3), as large as fits beside the panel."""
        camera = self._client.camera
        canvas, self._place = placed(rgb, (camera.image_width, camera.image_height))
        self._client.scene.set_background_image(canvas, format="jpeg", jpeg_quality=_JPEG_QUALITY)

    def hide(self) -> None:
        """Take the picture away."""
        if self._place is not None:
            self._place = None
            self._client.scene.set_background_image(None)

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        if self._place is not None:
            self._report_action(UserAction("click", *self._place.in_picture(*event.screen_pos)))


def _set(handle: Any, value: Any) -> None:
    """Set a control from here; viser's types call its value read-only."""
    handle.value = value
