"""A service tells a month ahead that its host's certificate ends."""

from __future__ import annotations

import asyncio
import datetime

import pytest

from rhot.process import certificate_watch
from testing.secured_rig import NOW, SecuredRig

DEADLINE_S = 60.0


@pytest.mark.parametrize(
    ("made_days_ago", "told"), [(0, None), (710, "in 20 days"), (735, "has ended")]
)
async def test_the_fault_stands_from_thirty_days_before_the_end(
    running, tmp_path, monkeypatch, made_days_ago, told
):
    monkeypatch.setattr(certificate_watch, "_PERIOD_S", 0.05)
    rig = SecuredRig(tmp_path)
    rig.make("master", "master", at=NOW - datetime.timedelta(days=made_days_ago))

    async def serve(service):
        service.tasks.create_task(certificate_watch.watch_certificate(service))
        service.ready()
        await asyncio.Event().wait()

    async with running("probe", serve, rig.config) as (service, _), asyncio.timeout(DEADLINE_S):
        if told is None:
            await asyncio.sleep(0.5)
            assert service.faults.standing() == []
        else:
            while not (faults := service.faults.standing()):
                await asyncio.sleep(0.01)
            (fault,) = faults
            assert fault.code == "certificate_expiring"
            assert fault.subject == "desk.master.master"
            assert told in fault.text
            # It ends once the file is new, without a restart.
            rig.make("master", "master")
            while service.faults.standing():
                await asyncio.sleep(0.05)


async def test_a_host_without_certificates_is_left_alone(running, tmp_path):
    rig = SecuredRig(tmp_path)
    (rig.hosts.host("master") / "own.pem").unlink()

    async def serve(service):
        await certificate_watch.watch_certificate(service)

    async with running("probe", serve, rig.config) as (service, _):
        await asyncio.sleep(0.5)
        assert service.faults.standing() == []
