"""Above a visitor's tabs: what is wrong with the rig and what to do; nothing while all is well."""

from __future__ import annotations

import viser

from rhot.watch.causes import causes
from services.viewer.panel import fault_texts
from services.viewer.visits.section import Seen


class Banner:
    """The worst causes of what is wrong; the rest is in a folder, closed at first."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._causes = client.gui.add_html("", visible=False)
        self._folder = client.gui.add_folder(
            "more, and what follows from it", expand_by_default=False, visible=False
        )
        with self._folder:
            self._follows = client.gui.add_html("")
        self._label = ""

    def update(self, seen: Seen) -> None:
        """Bring it up to date."""
        faults = fault_texts.of_no_start(seen.faults) if seen.starting else seen.faults
        found = causes(faults)
        wait = fault_texts.wait(seen.starting) if seen.starting else ""
        self._causes.visible = bool(wait or found)
        self._causes.content = wait + fault_texts.banner(found, seen.now_ns)
        follows = fault_texts.following(found)
        self._folder.visible = bool(follows)
        self._follows.content = follows
        at_rest = "starting ..." if seen.starting else _hands(seen)
        self._show_label(fault_texts.headline(found) or at_rest)

    def close(self) -> None:
        """Nothing is left behind."""

    def _show_label(self, words: str) -> None:
        """The panel's own line: all that a phone shows of it at first."""
        label = f"rhot: {words}" if words else "rhot"
        if label != self._label:
            self._label = label
            self._client.gui.set_panel_label(label)


def _hands(seen: Seen) -> str:
    hands = [f"{hand} hand" for hand, shown in seen.view.hands.items() if shown.seen]
    return f"{' and '.join(hands)} tracked" if hands else "no hand in view"
