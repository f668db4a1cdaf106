"""The page over HTTP and HTTPS: what is served, to whom."""

from __future__ import annotations

import asyncio
import json
import ssl
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import msgspec
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from rhot.errors import ConfigError
from rhot.files.bridge_tables import Bridges, WebXr
from rhot.files.config import RigConfig, load_rig
from services.bridges.webxr.service import serve, tls_context
from testing.secured_rig import SecuredRig

TOKEN = "correct-horse-battery"


def config_with(folder: Path | None = None, **options: Any) -> RigConfig:
    rig = load_rig(Path(__file__).parents[4] / "config" / "sim.toml")
    bridges = Bridges(webxr=WebXr(enabled=True, port=0, **options))
    return msgspec.structs.replace(rig, bridges=bridges, folder=str(folder or rig.folder))


def get(url: str, context: ssl.SSLContext | None = None) -> tuple[int, bytes]:
    try:
        with urllib.request.urlopen(url, timeout=20, context=context) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


async def port_of(service: Any) -> int:
    while "port" not in service.values:
        await asyncio.sleep(0.01)
    return int(service.values["port"])


async def test_the_page_is_free_and_what_the_rig_says_needs_the_token(running):
    config = config_with(token=TOKEN)
    async with running("bridge", serve, config, instance="webxr") as (service, _):
        here = f"127.0.0.1:{await port_of(service)}"
        for path, status in (
            ("/xr", 200),
            ("/xr/vendor/three.min.js", 200),
            (f"/?token={TOKEN}", 200),  # leads to /xr
            ("/", 401),
            ("/etc/passwd", 401),
            (f"/../../etc/passwd?token={TOKEN}", 404),
            (f"/live?token={TOKEN}", 426),
        ):
            found = await asyncio.to_thread(get, f"http://{here}{path}")
            assert found[0] == status, path
        with pytest.raises(InvalidStatus):
            await connect(f"ws://{here}/live")
        async with connect(f"ws://{here}/live?token={TOKEN}") as client:
            said = json.loads(await client.recv())["message"]
        assert len(said["floor_from_rig"]) == 16


async def test_a_certificate_of_the_rigs_own_makes_it_https(running, tmp_path):
    SecuredRig(tmp_path)
    names = {"certificate": "hosts/master/own.pem", "key": "hosts/master/own.key"}
    config = config_with(tmp_path, **names)
    trusting = ssl.create_default_context(cafile=tmp_path / "hosts" / "master" / "ca.pem")
    async with running("bridge", serve, config, instance="webxr") as (service, _):
        url = f"https://127.0.0.1:{await port_of(service)}/xr"
        assert (await asyncio.to_thread(get, url, trusting))[0] == 200


def test_files_that_are_no_certificate_say_so(tmp_path):
    (tmp_path / "a.pem").write_text("nothing")
    for names, reason in (
        ({"certificate": "a.pem"}, "needs both"),
        ({"certificate": "a.pem", "key": "gone.key"}, "cannot be used"),
        ({"certificate": "a.pem", "key": "a.pem"}, "cannot be used"),
    ):
        config = config_with(tmp_path, **names)
        with pytest.raises(ConfigError, match=reason):
            tls_context(config, config.bridges.webxr)
