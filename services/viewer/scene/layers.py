"""What a visitor can switch on and off in the scene.

Everything is drawn once, for all visitors; services/viewer/visits/layer.py shows or hides it to one
of them alone. Pure.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

LayerName = Literal["skin", "limits", "clouds", "trails"]


class Layer(NamedTuple):
    """The words of a layer's switch, and whether it is on where nobody has touched it."""

    label: str
    hint: str
    on: bool


LAYERS: dict[LayerName, Layer] = {
    "skin": Layer("skin", "the hand's skin over its joints and bones", True),
    "limits": Layer(
        "how far joints can bend",
        "an arc or a cone at each joint; it lights up where the joint can bend no further",
        False,
    ),
    "clouds": Layer(
        "how sure each marker is",
        "a cloud round each marker: 19 times of 20 it is inside. Small clouds are good",
        True,
    ),
    "trails": Layer("finger trails", "where the finger tips have just been", False),
}
DEFAULT: frozenset[LayerName] = frozenset(name for name, layer in LAYERS.items() if layer.on)


def path(layer: LayerName, name: str) -> str:
    """The path in the scene of something of a layer."""
    return f"/{layer}/{name}"
