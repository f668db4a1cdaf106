"""The way to a session: tried until a router answers, with the reason where it is a certificate."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Sequence

import zenoh

from rhot.bus.security.credentials import credentials_in, plain
from rhot.bus.security.tls_diagnosis import certificate_problem, exposed_key
from rhot.bus.zenoh_config import client_config
from rhot.errors import BusError

log = logging.getLogger("rhot.bus")

# Between attempts to reach a router that is not there yet: short, so that services are up as soon
# as it is.
_RETRY_S = 0.25
# A router that starts together with its clients takes a second or two, which is no news; one that
# is late is.
_SILENT_ATTEMPTS = 10
# Between two looks at the certificates while no router answers: a handshake with each of them.
_LOOK_AGAIN_S = 10.0


async def connected(connect: Sequence[str], despite_certificates: bool) -> zenoh.Session:
    """A session with the first router that answers at `connect`, however long it takes.

    Raises BusError if a certificate keeps it from opening, unless despite_certificates.
    """
    config = client_config(connect)
    for endpoint in connect:
        # It works, and somebody should mend it; a router with such a key does not start.
        files = credentials_in(endpoint)
        if files is not None and (warning := exposed_key(files)):
            log.warning("%s", warning)
    attempts, refused, look_s = 0, None, 0.0
    while True:
        try:
            return await asyncio.to_thread(zenoh.open, config)
        except zenoh.ZError as error:
            attempts += 1
            if time.monotonic() >= look_s:
                before, refused = refused, await _refusal_of(connect, despite_certificates)
                look_s = time.monotonic() + _LOOK_AGAIN_S
                if refused and refused != before:
                    log.error("%s [certificate_refused]", refused)
            if attempts == _SILENT_ATTEMPTS and not refused:
                log.warning(
                    "no router at %s yet, waiting for it%s",
                    ", ".join(map(plain, connect)),
                    _reason(error),
                )
            await asyncio.sleep(_RETRY_S)


def _reason(error: zenoh.ZError) -> str:
    """Why, where Zenoh says more than that nobody answers."""
    said = str(error).partition(" [")[0]
    return "" if said.startswith("Unable to connect") else f": {said}"


async def _refusal_of(connect: Sequence[str], despite_certificates: bool) -> str | None:
    """What a certificate has to do with a session that does not open; None if nothing."""
    problem = await asyncio.to_thread(certificate_problem, list(connect), time.time())
    if problem is not None and not despite_certificates:
        raise BusError(problem)
    return problem
