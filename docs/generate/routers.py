"""deploy/zenoh/*.json5: what `rhot router --print` prints for two rigs, ready for a zenohd."""

from __future__ import annotations

from rhot.bus.security.credentials import router_endpoints
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Bus, CameraTable
from services.cli.live.router import router_json5

# Where an installation has rig.toml and pki/.
_INSTALLED = "/etc/rhot"


def loopback() -> str:
    """The router of a rig whose cameras are on the master: nobody else reaches it."""
    return _json5(Bus())


def lan() -> str:
    """The router of a rig with two Pis and somebody who looks on."""
    listen = ("tcp/127.0.0.1:7447", "tls/0.0.0.0:7448")
    return _json5(Bus(listen=listen, viewers=("laptop",)))


def _json5(bus: Bus) -> str:
    cameras = [CameraTable(name=name, host=f"pi-{name}.local") for name in ("left", "right")]
    rig = RigConfig(bus=bus, camera=cameras, folder=_INSTALLED)
    return router_json5(router_endpoints(rig), rig) + "\n"
