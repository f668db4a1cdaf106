"""Which bridge runs."""

from __future__ import annotations

import importlib
import inspect

import pytest

from rhot.errors import ConfigError
from rhot.files.bridge_tables import Bridges
from rhot.files.config import RigConfig
from services.bridges.registry import BRIDGES, module_of
from services.bridges.service import serve


@pytest.mark.parametrize("name", BRIDGES)
def test_every_bridge_has_a_table_and_a_service_and_is_off_by_default(name):
    assert not getattr(Bridges(), name).enabled
    assert inspect.iscoroutinefunction(importlib.import_module(module_of(name)).serve)


def test_an_unknown_bridge_is_told_with_those_there_are():
    with pytest.raises(ConfigError, match=r"no bridge 'vcm'; give one of .*--instance"):
        module_of("vcm")


async def test_a_bridge_that_is_off_ends_in_peace(running):
    for name in BRIDGES[:1]:
        async with running("bridge", serve, RigConfig(), instance=name) as (service, _):
            assert service.state == "starting"
