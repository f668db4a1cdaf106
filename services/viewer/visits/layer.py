"""A part of the shared 3D scene that each visitor shows or hides for himself.

Its nodes are added to server.scene under the layer's path, and their own visibility is the same for
all; the node at the path itself is never added there. In each visitor's own scene it is a frame
without axes, whose visibility its children inherit: viser keeps the two scopes apart.
"""

from __future__ import annotations

import viser


class Layer:
    """The nodes under one path, say "/trails"; hidden until a visitor wants them."""

    def __init__(self, path: str) -> None:
        self.path = path
        self._frames: dict[int, viser.FrameHandle] = {}

    @property
    def wanted(self) -> bool:
        """Whether any visitor shows it: nobody has to draw it otherwise."""
        return any(frame.visible for frame in self._frames.values())

    def show(self, client: viser.ClientHandle, visible: bool) -> None:
        """Show or hide it in one visitor's view."""
        frame = self._frames.get(client.client_id)
        if frame is None:
            frame = client.scene.add_frame(self.path, show_axes=False, visible=visible)
            self._frames[client.client_id] = frame
        frame.visible = visible

    def forget(self, client: viser.ClientHandle) -> None:
        """The visitor has gone."""
        self._frames.pop(client.client_id, None)
