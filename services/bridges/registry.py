"""The bridges there are, each a room of its own with `service.py`. Pure.

A bridge's name is that of its room, of its table [bridges.NAME] in rig.toml and of the instance of
rhot-bridge that runs it.
"""

from __future__ import annotations

from rhot.errors import ConfigError

BRIDGES: tuple[str, ...] = ("vmc", "monado", "foxglove", "ros2", "websocket", "opengloves", "webxr")


def module_of(name: str) -> str:
    """The module with the coroutine `serve(service)` of that bridge.

    Raises ConfigError for a name that no bridge has.
    """
    if name not in BRIDGES:
        raise ConfigError(
            f"there is no bridge {name!r}; give one of {', '.join(BRIDGES)} with --instance"
        )
    return f"services.bridges.{name}.service"
