"""Whether anybody listens at an endpoint, and in words why not."""

from __future__ import annotations

import asyncio
import contextlib
import socket

from services.cli.doctor.observations import Reach

# A host on the same network answers within milliseconds; one that is off does not answer at all.
_TIMEOUT_S = 2.0
_PROTOCOLS = ("tcp", "tls")


async def reach(endpoint: str) -> Reach:
    """What a TCP connection to an endpoint says, without a word being exchanged."""
    protocol, _, rest = endpoint.partition("/")
    shown, address = endpoint.partition("#")[0], rest.partition("#")[0].partition("?")[0]
    if protocol not in _PROTOCOLS:
        return Reach(endpoint=shown, problem="")
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal():
        return Reach(endpoint=shown, problem="is no endpoint; write it like tcp/192.168.1.10:7447")
    return Reach(endpoint=shown, problem=await _problem(host.strip("[]"), int(port)))


async def _problem(host: str, port: int) -> str:
    try:
        async with asyncio.timeout(_TIMEOUT_S):
            _, writer = await asyncio.open_connection(host, port)
    except socket.gaierror:
        return f"no computer of the name {host} is known here"
    except ConnectionRefusedError:
        return f"{host} is there, but nothing listens at port {port}"
    except TimeoutError:
        return f"{host} does not answer: it is off, elsewhere, or behind a firewall"
    except (OSError, ValueError, OverflowError) as error:
        return f"{host} cannot be reached: {getattr(error, 'strerror', None) or error}"
    writer.close()
    with contextlib.suppress(OSError):
        await writer.wait_closed()
    return ""
