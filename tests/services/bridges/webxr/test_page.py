"""The page's files: all there, nothing from elsewhere."""

from __future__ import annotations

import re

import numpy as np
import pytest

from rhot.files.bridge_tables import WebXr
from services.bridges.placement import placement_of
from services.bridges.webxr.page import files, floor_from_rig, mesh_path


@pytest.fixture(scope="module")
def served():
    return files({"cup": b"glTF"})


def test_everything_that_the_page_names_is_served(served):
    texts = {path: file.content.decode() for path, file in served.items() if is_text(file)}
    html = texts["/xr"]
    named = set(re.findall(r'(?:href|src)="((?!data:)[^"]+)"', html))
    assert {f"/{name}" for name in named} == {"/xr/style.css", "/xr/main.js"}
    for path, text in texts.items():
        if not path.endswith((".min.js", ".entry.js")):
            for name in re.findall(r'from "\./([^"]+)"', text):
                assert f"/xr/{name}" in served, f"{path} imports {name}"
    assert {"/xr/left.glb", "/xr/right.glb", "/xr/vendor/three.LICENSE.txt"} <= set(served)


def is_text(file) -> bool:
    return "charset" in file.media_type


def test_nothing_comes_from_elsewhere(served):
    """The only address in any file is a name of XML's, which nobody fetches."""
    for path, file in served.items():
        if is_text(file):
            found = set(re.findall(rb"(?:https?|wss?)://[\w.]+[^\s\"'`)]*", file.content))
            assert found <= {b"http://www.w3.org/1999/xhtml"}, path


def test_shapes_of_the_rig_need_the_token_and_code_does_not(served):
    assert not served[mesh_path("cup")].open
    assert all(file.open for path, file in served.items() if path != mesh_path("cup"))


def test_the_rig_stands_where_rig_toml_says():
    placement = placement_of(WebXr(up="-y", position_m=(0.1, 0.8, -0.6), yaw_deg=0.0))
    T = np.array(floor_from_rig(placement)).reshape(4, 4)
    # The camera looks along WebXR's -z, 0.8 m above the floor.
    np.testing.assert_allclose(T @ [0.0, 0.0, 1.0, 1.0], [0.1, 0.8, -1.6, 1.0], atol=1e-9)
    np.testing.assert_allclose(T @ [0.0, 1.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], atol=1e-9)
