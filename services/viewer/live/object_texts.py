"""What the panel and the labels in the scene say of objects: states, touches, grasps. Pure.

Plain text: who shows it escapes it.
"""

from __future__ import annotations

from collections.abc import Iterator

from rhot.files.config import RigConfig
from rhot.watch.object_words import ADVICE, WORDS, holding, touching
from services.viewer.live.views import ObjectView, View


def object_lines(config: RigConfig, view: View) -> list[str]:
    """One line an object of rig.toml, then who holds and who touches."""
    return [*(_state(table.name, view) for table in config.object), *_hands(view)]


def label(view: ObjectView) -> str:
    """What stands beside the object in the scene."""
    return view.name if view.certain else f"{view.name}: {WORDS[view.state]}"


def _state(name: str, view: View) -> str:
    known = view.objects.get(name)
    if known is not None:
        advice = ADVICE[known.state]
        said = f"object {name}: {WORDS[known.state]}"
        return f"{said}; {advice}" if advice else said
    if name in view.silent_s:
        return (
            f"object {name}: nothing has come for {min(view.silent_s[name], 9999.0):.0f} s; "
            "is rhot-object-tracker running, and its tracker on?"
        )
    return f"waiting for the object {name} ..."


def _hands(view: View) -> Iterator[str]:
    held = set()
    for hold in view.holds:
        held.add((hold.hand, hold.object))
        yield holding(hold.hand, hold.object, hold.parts)
    for hand, name in dict.fromkeys((one.hand, one.object) for one in view.touches):
        if (hand, name) not in held:
            parts = [one.part for one in view.touches if (one.hand, one.object) == (hand, name)]
            yield touching(hand, name, parts)
