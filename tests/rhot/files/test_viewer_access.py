"""Beyond this machine the page needs a token, and its address has it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rhot.errors import ConfigError
from rhot.files.config import load_rig
from rhot.files.rig_tables import Viewer
from rhot.files.viewer_access import access_problem, page_address

TOKEN = "a-secret_of-16-or-more"


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_this_machine_needs_none(host: str) -> None:
    assert access_problem(Viewer(host=host)) is None


def test_another_address_needs_one_and_is_offered_one(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text('[viewer]\nhost = "0.0.0.0"\n')
    with pytest.raises(ConfigError, match="needs a token") as told:
        load_rig(path)
    offered = re.search(r'token = "([^"]+)"', str(told.value))
    assert offered is not None
    path.write_text(f'[viewer]\nhost = "0.0.0.0"\ntoken = "{offered[1]}"\n')
    assert load_rig(path).viewer.token == offered[1]
    assert access_problem(Viewer(host="0.0.0.0")) != str(told.value), "each is a new one"


@pytest.mark.parametrize(
    "token", ["short", "with spaces in it, many", "x" * 200, "ümlaut-and-more-x"]
)
def test_a_token_that_is_none_is_refused(tmp_path: Path, token: str) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(f'[viewer]\ntoken = "{token}"\n')
    with pytest.raises(ConfigError, match="token"):
        load_rig(path)


def test_addresses_to_open() -> None:
    assert page_address(Viewer(), 8080) == "http://127.0.0.1:8080"
    everywhere = Viewer(host="0.0.0.0", token=TOKEN)
    assert page_address(everywhere, 8081, "desk") == f"http://desk:8081/?token={TOKEN}"
    assert page_address(Viewer(host="::1"), 1, "desk") == "http://[::1]:1"
