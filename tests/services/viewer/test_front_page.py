"""viser's page as the page of a rig: one title, one icon, nothing else changed."""

from __future__ import annotations

from pathlib import Path

import viser

from services.viewer.front_page import front_page


def test_title_and_icon_are_ours_and_the_client_is_visers() -> None:
    index = Path(viser.__file__).parent / "client" / "build" / "index.html"
    visers = index.read_text(encoding="utf-8")
    page = front_page(visers)
    assert page.count("<title>") == visers.count("<title>") == 1
    assert "<title>rhot</title>" in page
    assert page.count('rel="icon"') == visers.count('rel="icon"') == 1
    client = visers.partition("</title>")[2]
    assert client, "viser's page has no title any more"
    assert page.endswith(client)
