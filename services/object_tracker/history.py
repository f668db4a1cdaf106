"""The last poses of one object, so that it is known at the instant of a hand's pose: the same as
programs beyond rhot use. Pure.
"""

from __future__ import annotations

from rhot.object_motion import ObjectHistory

__all__ = ["ObjectHistory"]
