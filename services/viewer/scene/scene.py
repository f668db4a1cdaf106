"""The 3D scene of the live view: draws a View with viser.

Meshes are made once and then moved; a hand, point or object that is gone is hidden. Without
calibration there are no frusta. What has not changed is not drawn anew, and what nobody has
switched on is not drawn at all.

A view is drawn in viser's own thread, between two of its messages to browsers: a picture is one
message, and never half of the one before. If that thread has not come to draw a view when the next
one is there, only the next one is drawn: who shows views never waits.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import viser

from rhot.files.config import RigConfig
from rhot.geometry.camera import Camera
from rhot.hand import HandModel, HandName, default_hand
from services.viewer.live.palette import Rgb
from services.viewer.live.views import HandView, PointView, View
from services.viewer.scene.hand import Limits, Stick, Trails
from services.viewer.scene.layers import DEFAULT, LayerName, path
from services.viewer.scene.markers import Markers
from services.viewer.scene.object_looks import ObjectLook
from services.viewer.scene.objects import Objects
from services.viewer.scene.room import add_room
from services.viewer.scene.skin import Skin
from services.viewer.scene.touches import Touches, touching

Layers = Collection[LayerName]


@dataclass
class _Hand:
    """A hand, and what of it was drawn last."""

    stick: Stick
    skin: Skin
    limits: Limits
    trails: Trails
    drawn: tuple[object, ...] = ()


class LiveScene:
    """Everything that is drawn; paints is what each hand's landmarks are painted with, looks how
    each object looks, models the hands that were measured.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        config: RigConfig,
        cameras: Mapping[str, Camera],
        paints: Mapping[tuple[HandName, str], Rgb],
        looks: Mapping[str, ObjectLook],
        models: Mapping[HandName, HandModel] | None = None,
    ) -> None:
        self._scene = server.scene
        self._atomic, self._flush = server.atomic, server.flush
        self._loop = server.get_event_loop()
        self._paints = paints
        self._models = models or {}
        self._hands: dict[HandName, _Hand] = {}
        self._markers: dict[HandName, Markers] = {}
        self._next: tuple[View, frozenset[LayerName]] | None = None
        self._asked = False
        self._error: BaseException | None = None
        add_room(server, config, cameras)
        self._objects = Objects(server.scene, looks)
        self._touches = Touches(server.scene)

    def show(self, view: View, layers: Layers = DEFAULT) -> None:
        """Have a view drawn, with the layers that anybody has switched on; does not wait for it.

        Raises what went wrong with the one before.
        """
        if self._error is not None:
            raise self._error
        # In this order, and the reverse one there: no view is left lying.
        self._next = view, frozenset(layers)
        if not self._asked:
            self._asked = True
            self._loop.call_soon_threadsafe(self._draw_next)

    def _draw_next(self) -> None:
        self._asked = False
        try:
            if self._next is not None:
                self.draw(*self._next)
        # Of any kind: it is the service's error, and this is viser's thread.
        except Exception as error:
            self._error = error

    def draw(self, view: View, layers: Layers) -> None:
        """Bring the picture up to date, in the calling thread."""
        with self._atomic():
            for hand in {*self._hands, *view.hands}:
                self._draw_hand(hand, view, layers)
            for hand in {*self._markers, *(name for name, _ in view.points)}:
                self._draw_markers(hand, view, layers)
            self._objects.show(view.objects, {touch.object for touch in view.touches})
            self._touches.show(view)
        # viser would wait a sixtieth of a second for more.
        self._flush()

    def _draw_hand(self, name: HandName, view: View, layers: Layers) -> None:
        if name not in self._hands:
            self._hands[name] = self._add_hand(name)
        hand, seen = self._hands[name], view.hands.get(name)
        lit = touching(view, name)
        wanted = (seen, lit, layers)
        # A page may be drawn more often than poses come.
        if hand.drawn != wanted:
            hand.stick.show(seen)
            hand.skin.show(_if("skin", layers, seen), lit)
            hand.limits.show(_if("limits", layers, seen))
            trail = view.trails.get(name, ()) if "trails" in layers else ()
            hand.trails.show(trail)
        hand.drawn = wanted

    def _add_hand(self, name: HandName) -> _Hand:
        scene = self._scene
        model = self._models.get(name) or default_hand(name)
        return _Hand(
            stick=Stick(scene, f"/hands/{name}"),
            skin=Skin(scene, path("skin", name), name),
            limits=Limits(scene, path("limits", name), model),
            trails=Trails(scene, path("trails", name)),
        )

    def _draw_markers(self, hand: HandName, view: View, layers: Layers) -> None:
        if hand not in self._markers:
            paints = {name: rgb for (of_hand, name), rgb in self._paints.items() if of_hand == hand}
            self._markers[hand] = Markers(
                self._scene, f"/hands/{hand}/points", path("clouds", hand), paints
            )
        points: dict[str, PointView] = {
            name: point for (of_hand, name), point in view.points.items() if of_hand == hand
        }
        self._markers[hand].show(points, clouds="clouds" in layers)


def _if(layer: LayerName, layers: Layers, seen: HandView | None) -> HandView | None:
    return seen if layer in layers else None
