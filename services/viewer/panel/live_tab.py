"""The tab "Live" of one visitor: switches, texts and camera pictures.

Its texts are made in services/viewer/panel/texts.py.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping, Sequence

import viser

from rhot.files.config import RigConfig
from rhot.hand import HandName
from rhot.messages.camera import SeenInPicture
from services.viewer.live.views import View
from services.viewer.panel import texts
from services.viewer.pictures.feed import PictureFeed, Take
from services.viewer.pictures.marks import Marks
from services.viewer.scene.layers import LAYERS, LayerName
from services.viewer.visits.layer import Layer
from services.viewer.visits.section import Seen

_NO_CAMERA, _ALL = "none", "all"


class LiveSection:
    """What is tracked now, and how well."""

    title = "Live"

    def __init__(
        self,
        config: RigConfig,
        notes: Sequence[str],
        feed: PictureFeed,
        layers: Mapping[LayerName, Layer],
        other_rigs: Callable[[], Sequence[tuple[str, str]]],
        *,
        replayed: bool,
    ) -> None:
        """other_rigs tells name and page of the other rigs of this process."""
        self.replayed = replayed
        self.config, self.notes, self.feed, self.layers = config, notes, feed, layers
        self.other_rigs = other_rigs

    def open(self, client: viser.ClientHandle, tab: viser.GuiTabHandle) -> LiveTab:  # noqa: ARG002
        """Fill one visitor's tab."""
        return LiveTab(client, self)


class LiveTab:
    """Switches and texts of one visitor."""

    def __init__(self, client: viser.ClientHandle, section: LiveSection) -> None:
        gui, config, notes = client.gui, section.config, section.notes
        self._client, self._config, self._notes = client, config, notes
        self._feed, self._layers = section.feed, section.layers
        self._other_rigs = section.other_rigs
        self._rigs = gui.add_html("", visible=False)
        self._replayed = section.replayed
        self._status = gui.add_html(self._said(_NOTHING))
        gui.add_html(texts.legend())
        self._switches = {
            name: gui.add_checkbox(words.label, words.on, hint=words.hint)
            for name, words in LAYERS.items()
        }
        self._show_layers()
        names = [camera.name for camera in config.camera]
        self._choice = gui.add_dropdown(
            "camera pictures",
            (_NO_CAMERA, *names, *([_ALL] if len(names) > 1 else [])),
            disabled=not names,
            hint="cameras send pictures only while somebody looks at them",
        )
        self._previews = {
            name: gui.add_html(texts.preview(name, None), visible=False) for name in names
        }
        self._watched: dict[str, Callable[[], None]] = {}
        self._angles: dict[HandName, viser.GuiHtmlHandle] = {}
        for hand in config.hand:
            with gui.add_folder(f"{hand} hand: bend of its joints, degrees"):
                self._angles[hand] = gui.add_html("")
        with gui.add_folder("programs and their rates", expand_by_default=False):
            self._rates = gui.add_html(texts.rates([]))

    def update(self, seen: Seen) -> None:
        """Bring the texts up to date, and watch the cameras that are chosen."""
        view = seen.view
        rigs = self._other_rigs()
        self._rigs.visible = bool(rigs)
        self._rigs.content = texts.other_rigs(self._config.rig.name, rigs)
        self._status.content = self._said(view)
        self._rates.content = texts.rates(view.health)
        for hand, handle in self._angles.items():
            handle.content = (
                texts.angles(view.hands[hand].pose) if hand in view.hands else texts.no_angles()
            )
        self._show_layers()
        self._watch(str(self._choice.value))

    def close(self) -> None:
        """The visitor has gone: nobody wants his pictures."""
        for stop in self._watched.values():
            stop()
        self._watched.clear()
        for layer in self._layers.values():
            layer.forget(self._client)

    def _said(self, view: View) -> str:
        return texts.status(self._config, view, self._notes, replayed=self._replayed)

    def _show_layers(self) -> None:
        for name, switch in self._switches.items():
            self._layers[name].show(self._client, bool(switch.value))

    def _watch(self, choice: str) -> None:
        for camera, handle in self._previews.items():
            wanted = choice in (camera, _ALL)
            if wanted == (camera in self._watched):
                continue
            handle.visible = wanted
            if wanted:
                self._watched[camera] = self._feed.watch(camera, self._showing(camera))
            else:
                self._watched.pop(camera)()
                handle.content = texts.preview(camera, None)

    def _showing(self, camera: str) -> Take:
        marks = Marks()

        def show(jpeg: bytes, seen: SeenInPicture | None) -> None:
            picture = base64.b64encode(jpeg).decode()
            over = "" if seen is None else marks.svg(seen)
            self._previews[camera].content = texts.preview(camera, picture, over)

        return show


_NOTHING = View(hands={}, points={}, objects={}, trails={}, health=[], latency_ms={})
