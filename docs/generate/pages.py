"""Which pages are generated, and which of them are not up to date."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from docs.generate import command, figures, messages, rig_toml, routers, topics

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "docs" / "reference"
GENERATED: dict[Path, Callable[[], str]] = {
    REFERENCE / "topics.md": topics.page,
    REFERENCE / "messages.md": messages.page,
    REFERENCE / "command.md": command.page,
    REFERENCE / "rig-toml.md": rig_toml.page,
    ROOT / "deploy" / "zenoh" / "loopback.json5": routers.loopback,
    ROOT / "deploy" / "zenoh" / "lan.json5": routers.lan,
}


def pages() -> list[Path]:
    """Every page of the project: docs/, and the ones beside it."""
    return [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]


def wanted(path: Path) -> str:
    """What a page should hold."""
    if path in GENERATED:
        return GENERATED[path]()
    return figures.rendered(path.read_text(encoding="utf-8"))


def stale() -> dict[Path, str]:
    """Pages that are not as they should be, and what they should hold."""
    found = {}
    for path in sorted({*pages(), *GENERATED}):
        text = wanted(path)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            found[path] = text
    return found
