"""Lamps and skins that clips of both halves have."""

from __future__ import annotations

from testing.second_renderer.room import Lamp, Light

WARM = Light(
    (Lamp((0.9, -0.8, -0.2), (5.0, 4.2, 3.2)), Lamp((-0.5, 0.6, -0.4), (1.5, 1.2, 0.9))),
    (1.1, 1.0, 0.85),
)
COLD = Light(
    (Lamp((-0.8, -0.2, -0.3), (3.4, 3.7, 4.2)), Lamp((0.3, -1.2, 0.1), (2.6, 2.7, 2.9))),
    (1.5, 1.6, 1.75),
)
WINDOW = Light(
    (Lamp((1.4, -0.4, -0.6), (4.0, 4.3, 4.6)), Lamp((-0.9, -0.9, 0.0), (1.2, 1.1, 0.9))),
    (1.6, 1.6, 1.6),
)
DARK, PALE = (0.22, 0.115, 0.08), (0.72, 0.47, 0.38)
