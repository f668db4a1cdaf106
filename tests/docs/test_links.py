"""Links of pages lead somewhere, with their anchors; scripts they name exist.

Commands and paths are tests/test_references.py's matter, for pages and code alike.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from docs.generate.pages import ROOT, pages

PAGES = pages()
# An example's, in docs/extend.md.
_EXAMPLES = ("services/pi_tracker/sources/pattern.py", "services/pinch/service.py")
_CODE_BLOCK = re.compile(r"^( *)```\w*\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_CODE = re.compile(r"`([^`\n]+)`")
_SCRIPT = re.compile(r"[\w./-]*\w\.py")


def slug(heading: str) -> str:
    """The anchor that GitHub makes of a heading."""
    return re.sub(r"[^\w -]", "", heading.strip().lower()).replace(" ", "-")


def anchors(page: Path) -> set[str]:
    """All anchors of a page."""
    text = _CODE_BLOCK.sub("", page.read_text(encoding="utf-8"))
    return {slug(line.lstrip("#")) for line in text.splitlines() if line.startswith("#")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    text = _CODE_BLOCK.sub("", page.read_text(encoding="utf-8"))
    for link in _LINK.findall(text):
        if link.startswith(("http://", "https://", "mailto:")):
            continue
        target, _, anchor = link.partition("#")
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), f"{link}: no such file"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path), f"{link}: no such heading"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_scripts_that_are_named_exist(page):
    text = page.read_text(encoding="utf-8")
    blocks = [block[2] for block in _CODE_BLOCK.finditer(text)]
    names = [word for code in [*_CODE.findall(text), *blocks] for word in code.split()]
    for name in names:
        if _SCRIPT.fullmatch(name):
            exists = (ROOT / name).exists() or list(ROOT.glob(f"[a-z]*/**/{name}"))
            assert exists or name in _EXAMPLES, f"{name}: no file ends so"
