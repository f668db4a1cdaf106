"""The clips, a tuning half and a held-out half: other people, motions, lights, sensors and rigs.

Pure data.
"""

from __future__ import annotations

from testing.families.case import Half
from testing.second_renderer.catalog.held_out import HELD_OUT
from testing.second_renderer.catalog.tuning import TUNING
from testing.second_renderer.clip import Clip

CLIPS: dict[Half, dict[str, Clip]] = {"tuning": TUNING, "held_out": HELD_OUT}
