"""What one client is still to get: the newest message of each topic, and nothing older. Pure."""

from __future__ import annotations

from services.bridges.websocket.protocol import EVERYTHING, Request

# Names come from the network, memory must not. A rig has two hands and a few objects.
_MAX_TOPICS = 256


class Outbox:
    """Frames that wait for one client; a newer one of a topic takes the place of the older."""

    def __init__(self) -> None:
        self.request: Request = EVERYTHING
        self.skipped = 0
        self._waiting: dict[str, str] = {}
        self._wanted: dict[str, bool] = {}

    def ask(self, request: Request) -> None:
        """From now on the client wants this."""
        self.request = request
        self._wanted.clear()
        self._waiting = {topic: text for topic, text in self._waiting.items() if self._wants(topic)}

    def put(self, topic: str, text: str) -> bool:
        """A frame for the client; whether it wants it."""
        if not self._wants(topic):
            return False
        if topic in self._waiting:
            self.skipped += 1
        elif len(self._waiting) >= _MAX_TOPICS:
            return False
        self._waiting[topic] = text
        return True

    def put_always(self, topic: str, text: str) -> None:
        """An answer, which no request leaves out."""
        self._waiting[topic] = text

    def take(self) -> list[str]:
        """All that waits, to be sent now."""
        waiting, self._waiting = list(self._waiting.values()), {}
        return waiting

    def _wants(self, topic: str) -> bool:
        wanted = self._wanted.get(topic)
        if wanted is None:
            wanted = self.request.wants(topic)
            if len(self._wanted) < _MAX_TOPICS:
                self._wanted[topic] = wanted
        return wanted
