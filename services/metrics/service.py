"""The rig's health for Prometheus, at http://127.0.0.1:9464/metrics (or [metrics] host and port).

Off unless rig.toml says `[metrics] enabled = true`. A scrape answers with the state of the last
second, and costs the rig nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Iterator
from wsgiref.simple_server import WSGIServer

from prometheus_client import start_http_server
from prometheus_client.core import Metric
from prometheus_client.registry import Collector, CollectorRegistry

from rhot import clock
from rhot.errors import BusError
from rhot.process import systemd
from rhot.process.service import Service
from rhot.watch.follow import watching_objects
from services.metrics.counting_monitor import CountingMonitor
from services.metrics.families import families

log = logging.getLogger("rhot.metrics")

_REFRESH_S = 1.0


async def serve(service: Service) -> None:
    """Answers Prometheus' scrapes with the rig's health."""
    table = service.config.metrics
    if not table.enabled:
        log.info("metrics are off; `enabled = true` under [metrics] in rig.toml switches them on")
        systemd.notify("READY=1")
        return
    monitor = CountingMonitor(service.config, clock.now_ns())
    snapshot = Snapshot()
    async with watching_objects(service.bus, monitor):
        with http_server(table.host, table.port, snapshot) as port:
            service.values["port"] = port
            log.info("metrics at http://%s:%d/metrics", table.host, port)
            service.ready()
            while True:
                # Here, not in the server's thread: what is watched changes on this loop.
                snapshot.metrics = list(families(monitor.state(clock.now_ns()), monitor))
                await asyncio.sleep(_REFRESH_S)


class Snapshot(Collector):
    """The metrics of the last second, for the server's thread."""

    def __init__(self) -> None:
        self.metrics: list[Metric] = []

    def collect(self) -> Iterator[Metric]:
        """What a scrape answers with."""
        return iter(self.metrics)


@contextlib.contextmanager
def http_server(host: str, port: int, snapshot: Snapshot) -> Iterator[int]:
    """Serves for as long as the block lasts; the port, another one for port 0.

    Raises BusError if it is taken, or the host is none of this computer's.
    """
    registry = CollectorRegistry()
    registry.register(snapshot)
    try:
        server: WSGIServer
        server, thread = start_http_server(port, host, registry)
    except OSError as error:
        raise BusError(
            f"metrics cannot be served at {host}:{port}: {error.strerror or error}; "
            "set another host or port under [metrics] in rig.toml, 0 for any free port"
        ) from None
    try:
        yield server.server_port
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
