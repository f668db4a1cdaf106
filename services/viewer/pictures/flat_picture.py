"""A picture that fills one visitor's view beside the panel: flat, whatever the mouse does.

It is the background of the visitor's own view. His camera is moved away from the rig meanwhile, so
that nothing is drawn over it, and back afterwards. viser calls `clicked` from a thread of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from services.viewer.pictures.fitting import Fitted, Image, fitted

# Behind the camera then, the rig is in no direction in which a hand could turn it back by chance.
_AWAY_M = 1000.0
_JPEG_QUALITY = 90
# A window of which nothing is known yet: a desk's, beside the panel.
_ASPECT = 880.0 / 800.0


class FlatPicture:
    """The picture of one visitor; clicked(x, y) tells of clicks on it, from 0 to 1."""

    def __init__(
        self, client: viser.ClientHandle, clicked: Callable[[float, float], object] | None = None
    ) -> None:
        self._client, self._clicked = client, clicked
        self._fitted: Fitted | None = None
        self._moved_m = np.zeros(3)

    @property
    def shown(self) -> bool:
        """Whether a picture is shown."""
        return self._fitted is not None

    def show(self, rgb: Image) -> None:
        """Show a picture (h, w, 3), or the next one in its place."""
        camera = self._client.camera
        known = camera.image_width > 0 and camera.image_height > 0
        first = not self.shown
        made = fitted(rgb, camera.image_width / camera.image_height if known else _ASPECT)
        self._fitted = made
        with self._client.atomic():
            self._client.scene.set_background_image(
                made.rgb, format="jpeg", jpeg_quality=_JPEG_QUALITY
            )
            if first:
                self._leave_rig()
        if first and self._clicked is not None:
            self._client.scene.on_click()(self._on_click)

    def hide(self) -> None:
        """Take the picture away, and look at the rig again."""
        if not self.shown:
            return
        self._fitted = None
        with self._client.atomic():
            self._client.scene.set_background_image(None)
            self._client.camera.position = self._client.camera.position - self._moved_m
        if self._clicked is not None:
            self._client.scene.remove_click_callback(self._on_click)

    def _leave_rig(self) -> None:
        camera = self._client.camera
        ahead = camera.look_at - camera.position
        self._moved_m = _AWAY_M * ahead / max(float(np.linalg.norm(ahead)), 1e-6)
        camera.position = camera.position + self._moved_m

    def _on_click(self, event: Any) -> None:
        made = self._fitted
        place = None if made is None else made.inside(*event.screen_pos)
        if place is not None and self._clicked is not None:
            self._clicked(*place)
