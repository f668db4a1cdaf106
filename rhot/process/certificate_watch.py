"""A service's look at its host's certificate, once an hour: a fault a month before it ends."""

from __future__ import annotations

import asyncio
import time

from rhot.bus.security.credentials import client_endpoints, credentials_in
from rhot.bus.security.tls_diagnosis import read_own_certificate
from rhot.errors import BusError
from rhot.process.service import Service

# A month holds a visit to every host, whoever is on holiday.
WARN_DAYS = 30.0
# A certificate lasts for years, and the files are read anew: a renewal is seen within the hour.
_PERIOD_S = 3600.0


async def watch_certificate(service: Service) -> None:
    """Report `certificate_expiring` for as long as this host's certificate is about to end."""
    files = [credentials_in(endpoint) for endpoint in client_endpoints(service.config)]
    while used := next((one for one in files if one is not None), None):
        try:
            own = await asyncio.to_thread(read_own_certificate, used)
        except BusError:
            # Said when it kept a session from opening; this service has one, on loopback perhaps.
            service.faults.replace("certificate_expiring", {})
        else:
            days = own.days_left(time.time())
            when = f"ends on {own.end_date}, in {days:.0f} days" if days > 0 else "has ended"
            text = f"this host's certificate {own.common_name} {when}"
            soon = {own.common_name: text} if days < WARN_DAYS else {}
            service.faults.replace("certificate_expiring", soon)
        await asyncio.sleep(_PERIOD_S)
