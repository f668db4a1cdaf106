"""The reference pages and the tables of figures are what `make docs` would write now."""

from __future__ import annotations

import subprocess
import sys

import pytest

from docs.generate import command
from docs.generate.figures import too_wide
from docs.generate.markdown import COLUMNS
from docs.generate.pages import GENERATED, ROOT, pages, wanted


@pytest.mark.parametrize("path", sorted({*pages(), *GENERATED}), ids=lambda path: path.name)
def test_a_page_is_up_to_date(path):
    assert path.read_text(encoding="utf-8") == wanted(path), "run `make docs`"


def test_the_table_of_services_has_them_all():
    # The room holds all bridges, a process runs one.
    rooms = {path.parent.name for path in (ROOT / "services").glob("*/service.py")}
    scripts = rooms - {"bridges"} | {"bridge"}
    assert {f"rhot-{name.replace('_', '-')}" for name in scripts} == set(command.services())


@pytest.mark.parametrize("service", ["pi_tracker", "recorder"])
def test_services_take_the_options_that_the_page_lists(service):
    module = f"services.{service}"
    told = subprocess.run(
        [sys.executable, "-m", module, "--help"], capture_output=True, text=True, check=True
    ).stdout
    other = "--instance" if service == "pi_tracker" else "--camera"
    for option in {name.split()[0] for name in command.SERVICE_OPTIONS} - {other}:
        assert option in told
    assert other not in told


@pytest.mark.parametrize("folder", ["guide", "reference", "notes"])
def test_lines_of_pages_are_short(folder):
    for path in (ROOT / "docs" / folder).glob("*.md"):
        assert not too_wide(path.read_text(encoding="utf-8")), f"{path}: wider than {COLUMNS}"


def test_every_command_has_a_section():
    page = command.page()
    assert "### rhot calibrate lens\n" in page
    assert "-o, --out PATH" in page
