"""The state of the live view, kept from messages. Pure: time is an argument (seconds of one
monotonic clock).

What has not come for a second is hidden, and said to be missing. Implausible positions (not finite,
beyond 100 m) are not drawn. Objects in the lighthouse frame are not drawn either: where they are in
the rig would be a guess. Who touches what holds for as long as contacts are fresh. Nothing from the
network makes the state grow without bound.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from rhot.geometry.transforms import Array
from rhot.hand import CHAIN_JOINTS, LANDMARKS, HandName
from rhot.messages import HandPoint, HandPoints, HandPose
from rhot.messages.health import Health
from rhot.messages.objects import (
    Grasp,
    ObjectContacts,
    ObjectPose,
)
from services.viewer.live.views import HandView, HoldView, ObjectView, PointView, TouchView, View

K = TypeVar("K")
V = TypeVar("V")

# What is older than this is not live any more.
STALE_S = 1.0
# Three beats of a service's health.
HEALTH_STALE_S = 3.5
# Beyond any room; float32 on the way to the browser would overflow at 1e38.
_MAX_M = 100.0
_MAX_OBJECTS, _MAX_SERVICES = 32, 64
# Trails are to show a movement, not to fill the page; of no more tips than that.
TRAIL_S, TRAIL = 0.7, 60
# A stamp further from now than this is a replay's or another clock's, and says nothing about
# latency.
_MAX_LATENCY_S = 10.0


@dataclass
class _Hand:
    view: HandView
    seen_s: float
    latency_ms: float | None
    # When, and where the tips were.
    trail: deque[tuple[float, Array]] = field(default_factory=lambda: deque(maxlen=TRAIL))


class ViewModel:
    """Takes messages, gives views.

    implausible counts positions that were left out.
    """

    def __init__(self) -> None:
        self._hands: dict[HandName, _Hand] = {}
        self._points: dict[HandName, tuple[float, list[PointView]]] = {}
        self._objects: dict[str, tuple[float, ObjectView]] = {}
        self._heard_s: dict[str, float] = {}
        self._contacts: dict[str, tuple[float, tuple[list[TouchView], list[HoldView]]]] = {}
        self._health: dict[tuple[str, str], tuple[float, Health]] = {}
        self.implausible = 0

    def pose(self, pose: HandPose, now_s: float, wall_ns: int) -> None:
        """Take a hand pose that arrived now, at wall_ns of the wall clock."""
        positions = np.array([joint.position_m for joint in pose.joints])  # (26, 3)
        radii = np.array([joint.radius_m for joint in pose.joints])
        if not np.all(np.abs(positions) <= _MAX_M) or not np.all(radii <= _MAX_M):
            self.implausible += 1
            return
        view = HandView(
            pose.hand, positions, radii, tuple(joint.source for joint in pose.joints), pose
        )
        latency_s = (wall_ns - pose.stamp_ns) * 1e-9
        latency_ms = latency_s * 1e3 if abs(latency_s) <= _MAX_LATENCY_S else None
        known = self._hands.get(pose.hand)
        if known is None or now_s - known.seen_s > STALE_S:
            known = self._hands[pose.hand] = _Hand(view, now_s, latency_ms)
        known.view, known.seen_s, known.latency_ms = view, now_s, latency_ms
        known.trail.append((now_s, positions[CHAIN_JOINTS[:, 3]]))

    def points(self, points: HandPoints, now_s: float) -> None:
        """Take the painted landmarks of a hand."""
        drawn = []
        for point in points.points:
            if point.name in LANDMARKS and all(abs(v) <= _MAX_M for v in point.position_m):
                drawn.append(
                    PointView(
                        points.hand,
                        point.name,
                        point.position_m,
                        point.source == "predicted",
                        _covariance(point),
                    )
                )
            else:
                self.implausible += 1
        self._points[points.hand] = (now_s, drawn)

    def object(self, pose: ObjectPose, now_s: float) -> None:
        """Take an object's pose."""
        norm = float(np.sqrt(np.sum(np.minimum(np.abs(pose.orientation_wxyz), 1e9) ** 2)))
        if not all(abs(v) <= _MAX_M for v in pose.position_m) or not 0.5 < norm < 2.0:
            self.implausible += 1
            return
        if pose.object in self._objects or len(self._objects) < _MAX_OBJECTS:
            view = ObjectView(
                pose.object, pose.position_m, pose.orientation_wxyz, pose.tracking, pose.registered
            )
            self._objects[pose.object] = (now_s, view)
            if pose.object in self._heard_s or len(self._heard_s) < _MAX_OBJECTS:
                self._heard_s[pose.object] = now_s

    def contacts(self, contacts: ObjectContacts, now_s: float) -> None:
        """Take who touches an object, and who holds it."""
        touches = []
        for one in contacts.contacts:
            if not all(abs(v) <= _MAX_M for v in one.point_m):
                self.implausible += 1
            elif one.touching:
                touches.append(TouchView(contacts.object, one.hand, one.part, one.point_m))
        holds = [_hold(contacts.object, grasp) for grasp in contacts.grasps]
        if contacts.object in self._contacts or len(self._contacts) < _MAX_OBJECTS:
            self._contacts[contacts.object] = (now_s, (touches, holds))

    def health(self, health: Health, now_s: float) -> None:
        """Take a service's health."""
        key = (health.service, health.instance)
        if key in self._health or len(self._health) < _MAX_SERVICES:
            self._health[key] = (now_s, health)

    def view(self, now_s: float) -> View:
        """What is to be seen now; forgets what is stale."""
        self._hands = {
            name: hand for name, hand in self._hands.items() if now_s - hand.seen_s <= STALE_S
        }
        self._points = _fresh(self._points, now_s, STALE_S)
        self._objects = _fresh(self._objects, now_s, STALE_S)
        self._contacts = _fresh(self._contacts, now_s, STALE_S)
        self._health = _fresh(self._health, now_s, HEALTH_STALE_S)
        contacts = [both for _, both in self._contacts.values()]
        return View(
            hands={name: hand.view for name, hand in self._hands.items()},
            points={(p.hand, p.name): p for _, points in self._points.values() for p in points},
            objects={name: view for name, (_, view) in self._objects.items()},
            trails={
                name: [tips for at_s, tips in hand.trail if now_s - at_s <= TRAIL_S]
                for name, hand in self._hands.items()
            },
            health=[
                health for _, (_, health) in sorted(self._health.items(), key=lambda item: item[0])
            ],
            latency_ms={name: hand.latency_ms for name, hand in self._hands.items()},
            touches=[touch for touches, _ in contacts for touch in touches],
            holds=[hold for _, holds in contacts for hold in holds],
            silent_s={
                name: now_s - heard_s
                for name, heard_s in self._heard_s.items()
                if name not in self._objects
            },
        )


def _covariance(point: HandPoint) -> tuple[float, ...]:
    if point.covariance_m2 is not None:
        return point.covariance_m2
    # Where no more than sigma is known, its square is bounded as positions are.
    x, y, z = (min(sigma, _MAX_M) ** 2 for sigma in point.sigma_m)
    return (x, 0.0, 0.0, y, 0.0, z)


def _hold(name: str, grasp: Grasp) -> HoldView:
    return HoldView(name, grasp.hand, tuple(dict.fromkeys(grasp.parts)))


def _fresh(
    entries: dict[K, tuple[float, V]], now_s: float, stale_s: float
) -> dict[K, tuple[float, V]]:
    """Those of the entries, (arrival, value) each, that are not stale."""
    return {key: entry for key, entry in entries.items() if now_s - entry[0] <= stale_s}
