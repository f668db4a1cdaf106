"""Certificates as options of endpoints."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot.bus.security.credentials import (
    Credentials,
    client_endpoints,
    credentials_in,
    plain,
    router_endpoints,
    with_certificates,
)
from rhot.errors import BusError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Bus

FOLDER = Path("/etc/rhot/pki")
BOTH = ("tcp/127.0.0.1:7447", "tls/master.local:7448")


def test_only_secured_endpoints_get_certificates():
    open_one, secured = with_certificates(BOTH, FOLDER, "connect")
    assert open_one == BOTH[0]
    assert plain(secured) == BOTH[1]
    assert credentials_in(secured) == Credentials.of(FOLDER)
    assert credentials_in(open_one) is None


def test_options_somebody_wrote_stay():
    own = "tls/master.local:7448#root_ca_certificate_file=/x/ca.pem"
    assert with_certificates([own], FOLDER, "connect") == [own]


def test_without_a_folder_nothing_changes():
    assert with_certificates(BOTH, None, "connect") == list(BOTH)


def test_a_rig_names_the_folder_relative_to_rig_toml():
    rig = RigConfig(bus=Bus(connect=BOTH, listen=BOTH, certificates="mine"), folder="/etc/rhot")
    for endpoints in (client_endpoints(rig), router_endpoints(rig)):
        assert credentials_in(endpoints[1]) == Credentials.of(Path("/etc/rhot/mine"))
    assert "connect_private_key_file=" in client_endpoints(rig)[1]
    assert "listen_private_key_file=" in router_endpoints(rig)[1]


@pytest.mark.parametrize("folder", ["/a;b", "/a#b", "/a=b", "/a?b"])
def test_a_path_that_cannot_stand_in_an_endpoint_is_refused(folder):
    with pytest.raises(BusError, match="move it"):
        with_certificates(BOTH, Path(folder), "connect")
