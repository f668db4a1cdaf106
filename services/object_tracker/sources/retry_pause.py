"""How long to wait before a source that failed is tried again. Pure."""

from __future__ import annotations

# SteamVR takes some seconds to start, and trying is cheap.
_FIRST_S = 1.0
# A tracker's dongle that is plugged in again should not wait for minutes.
_LONGEST_S = 30.0


class RetryPause:
    """Doubles from failure to failure, and begins anew after a success."""

    def __init__(self) -> None:
        self._next_s = _FIRST_S

    def after_failure(self) -> float:
        """Seconds to wait now."""
        pause_s, self._next_s = self._next_s, min(2.0 * self._next_s, _LONGEST_S)
        return pause_s

    def succeeded(self) -> None:
        """A pose came."""
        self._next_s = _FIRST_S
