"""One visitor's page: a head, and below it a tab for each section, in his own controls."""

from __future__ import annotations

from collections.abc import Sequence

import viser

from services.viewer.visits.section import Head, Section, Seen

# A row of the rates' table fits; at 1280 pixels the scene has two thirds of the window.
_PANEL_PX = 400.0


class Visit:
    """A browser that looks, with everything that only it sees."""

    def __init__(self, client: viser.ClientHandle, head: Head, sections: Sequence[Section]) -> None:
        self.client = client
        # Beside the scene and not over it. A phone has it as a sheet at the bottom anyway.
        client.gui.main_panel.dock_right()
        client.gui.main_panel.set_width(_PANEL_PX)
        self._open = [head(client)]
        tabs = client.gui.add_tab_group()
        for section in sections:
            with (tab := tabs.add_tab(section.title)):
                self._open.append(section.open(client, tab))

    def update(self, seen: Seen) -> None:
        """Bring every tab up to date."""
        with self.client.atomic():
            for section in self._open:
                section.update(seen)

    def close(self) -> None:
        """The visitor has gone."""
        for section in self._open:
            section.close()
