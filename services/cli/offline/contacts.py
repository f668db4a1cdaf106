"""Contacts of a run of `rhot track`: the object tracker's own step, fed in the order of time. Pure.

Each hand's pose meets the objects' poses up to the first after it, so that objects are interpolated
rather than predicted.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rhot.files.config import RigConfig
from rhot.messages import HandPose
from rhot.messages.objects import ObjectContacts, ObjectPose
from services.object_tracker.contacts.step import ContactStep, solids_of


class ContactTrack:
    """All objects of a rig that have a shape; without any, no contacts come out."""

    def __init__(self, config: RigConfig, poses: Iterable[ObjectPose]) -> None:
        """poses of all objects in the order of time, taken one by one.

        Raises ConfigError or CalibrationError if a shape cannot be used.
        """
        solids = solids_of(config)
        self._step = ContactStep(solids)
        # Without a shape nothing is read.
        self._poses: Iterator[ObjectPose] = iter(poses) if solids else iter(())
        self._noted_ns = -1

    def step(self, hands: list[HandPose]) -> list[ObjectContacts]:
        """What these poses change."""
        messages = []
        for hand in hands:
            while self._noted_ns <= hand.stamp_ns and (pose := next(self._poses, None)):
                self._step.note(pose)
                self._noted_ns = pose.stamp_ns
            messages += self._step.step(hand)
        return messages
