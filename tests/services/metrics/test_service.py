"""The running exporter on a real router, scraped over HTTP."""

from __future__ import annotations

import asyncio
import urllib.request

import pytest

from rhot import topics
from rhot.errors import BusError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Metrics
from services.metrics.service import Snapshot, http_server, serve
from testing.sample_health import beat, fault


def scrape(port):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=5.0) as answer:
        return answer.read().decode()


async def test_a_scrape_tells_what_services_tell(running, sending):
    config = RigConfig(metrics=Metrics(enabled=True, port=0))
    async with running("metrics", serve, config) as (service, bus):
        while service.state != "running":
            await asyncio.sleep(0.02)
        publisher = bus.publisher(topics.HEALTH, service="fusion", instance="main")
        message = beat("fusion", faults=[fault("camera_moved", "moved", "left")])
        with sending(lambda: publisher.put(message)):
            text = ""
            while 'rhot_fault{code="camera_moved"' not in text:
                await asyncio.sleep(0.1)
                text = await asyncio.to_thread(scrape, int(service.values["port"]))
        assert 'rhot_service_up{instance="main",service="fusion"} 1.0' in text
        assert "rhot_router_connected 1.0" in text


async def test_it_is_off_by_default_and_on_loopback_only(running):
    assert Metrics().host == "127.0.0.1"
    async with running("metrics", serve, RigConfig()) as (service, _):
        await asyncio.sleep(0.1)
        assert service.state == "starting"
        assert "port" not in service.values


def test_a_port_that_is_taken_is_named():
    with (
        http_server("127.0.0.1", 0, Snapshot()) as port,
        pytest.raises(BusError, match=f"127.0.0.1:{port}.*\\[metrics\\]"),
        http_server("127.0.0.1", port, Snapshot()),
    ):
        pass
