"""What a tour looks at before it says that something happened. Pure.

Everything is taken from the messages that any program of a rig receives.
"""

from __future__ import annotations

from rhot.hand import DIGITS, HandName
from rhot.messages import HandPoints
from rhot.messages.health import Fault, Health
from rhot.messages.objects import Grasp, HandPart, ObjectContacts


class Evidence:
    """The newest points, faults and contacts of a rig."""

    def __init__(self) -> None:
        # Of each landmark of a hand, whether it is measured now.
        self._measured: dict[tuple[HandName, str], bool] = {}
        # (service, instance) -> what it says is wrong.
        self._faults: dict[tuple[str, str], list[Fault]] = {}
        self._contacts: dict[str, ObjectContacts] = {}

    def add_points(self, message: HandPoints) -> None:
        """A landmark that is not in the message is not measured either."""
        for hand, name in self._measured:
            if hand == message.hand:
                self._measured[hand, name] = False
        for point in message.points:
            self._measured[message.hand, point.name] = point.source == "measured"

    def add_health(self, beat: Health) -> None:
        """What a service says is wrong."""
        self._faults[beat.service, beat.instance] = beat.faults

    def add_contacts(self, message: ObjectContacts) -> None:
        """Who touches an object."""
        self._contacts[message.object] = message

    def measured(self, hand: HandName, landmark: str) -> bool | None:
        """Whether that landmark is measured now; None before the first points."""
        return self._measured.get((hand, landmark))

    def fault(self, code: str, subject: str = "") -> Fault | None:
        """The fault of that code that some service tells of, whose subject or text has the word."""
        for faults in self._faults.values():
            for one in faults:
                if one.code == code and (subject in one.subject or subject in one.text):
                    return one
        return None

    def touching(self, thing: str) -> list[HandPart]:
        """Parts of a hand that touch that object now, from the thumb on."""
        message = self._contacts.get(thing)
        parts = [one.part for one in message.contacts if one.touching] if message else []
        return sorted(parts, key=(*DIGITS, "palm").index)

    def grasp(self, thing: str) -> Grasp | None:
        """Who holds that object now."""
        message = self._contacts.get(thing)
        return message.grasps[0] if message and message.grasps else None
