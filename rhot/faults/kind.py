"""What one fault code means. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from rhot.messages.health import Severity


@dataclass(frozen=True)
class FaultKind:
    """What one code means.

    error: no pose, or a wrong one, as long as it lasts; warning: it works, but worse or not for
    long. action may name {subject}, which is filled in.
    """

    code: str
    severity: Severity
    meaning: str
    action: str

    def action_for(self, subject: str) -> str:
        """What to do about this subject."""
        return self.action.replace("{subject}", subject)


def error(code: str, meaning: str, action: str) -> FaultKind:
    """A condition under which there is no pose, or a wrong one."""
    return FaultKind(code, "error", meaning, action)


def warning(code: str, meaning: str, action: str) -> FaultKind:
    """A condition under which it works, but worse or not for long."""
    return FaultKind(code, "warning", meaning, action)
