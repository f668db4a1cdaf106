"""What there is to draw at one instant: hands, painted landmarks, objects, who touches and holds
them. Positions are in the rig frame, metres. Pure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from rhot.geometry.transforms import Array
from rhot.hand import HandName
from rhot.messages import HandPose
from rhot.messages.health import Health
from rhot.messages.objects import HandPart, ObjectTracking
from rhot.watch.object_words import state_of


@dataclass(frozen=True, eq=False)
class HandView:
    """A hand to draw; sources are those of its 26 joints."""

    hand: HandName
    positions_m: Array  # (26, 3)
    radii_m: Array  # (26,)
    sources: tuple[str, ...]
    pose: HandPose

    @property
    def seen(self) -> bool:
        """Whether cameras see anything of it; else all of it is expected."""
        return any(source != "predicted" for source in self.sources)

    @cached_property
    def rotations(self) -> Array:
        """(26, 3, 3) of the joints; one whose orientation is none is not turned."""
        wxyz = self.pose.orientations_wxyz
        length = np.sqrt(np.sum(np.minimum(np.abs(wxyz), 1e9) ** 2, axis=1))
        turned = (length > 0.5) & (length < 2.0)
        rotations: Array = Rotation.from_quat(
            np.where(turned[:, None], wxyz, [1.0, 0.0, 0.0, 0.0])[:, [1, 2, 3, 0]]
        ).as_matrix()
        return rotations


@dataclass(frozen=True)
class PointView:
    """A painted landmark; a predicted one is not measured at this instant.

    covariance_m2 of its position: xx, xy, xz, yy, yz, zz.
    """

    hand: HandName
    name: str
    position_m: tuple[float, float, float]
    predicted: bool
    covariance_m2: tuple[float, ...] = (0.0,) * 6


@dataclass(frozen=True)
class ObjectView:
    """An object; drawn is false while it is lost or not registered.

    certain is false while its tracker is not located: it is drawn where it was carried on to.
    """

    name: str
    position_m: tuple[float, float, float]
    orientation_wxyz: tuple[float, float, float, float]
    tracking: ObjectTracking
    registered: bool

    @property
    def drawn(self) -> bool:
        """Whether its pose is one in the rig frame."""
        return self.registered and self.tracking not in ("lost", "unregistered")

    @property
    def certain(self) -> bool:
        """Whether it is seen where it is drawn."""
        return self.drawn and self.tracking == "ok"

    @property
    def state(self) -> ObjectTracking:
        """Its tracking, "unregistered" before all if its place in the rig is unknown."""
        return state_of(self.tracking, self.registered)


@dataclass(frozen=True)
class TouchView:
    """A finger tip, or the palm, that touches an object at point_m (rig frame)."""

    object: str
    hand: HandName
    part: HandPart
    point_m: tuple[float, float, float]


@dataclass(frozen=True)
class HoldView:
    """A hand that holds an object, and with which parts."""

    object: str
    hand: HandName
    parts: tuple[HandPart, ...]


@dataclass(frozen=True)
class View:
    """Everything to draw at one instant; trails are finger tips, (5, 3) each, oldest first."""

    hands: dict[HandName, HandView]
    points: dict[tuple[HandName, str], PointView]
    objects: dict[str, ObjectView]
    trails: Mapping[HandName, Sequence[Array]]
    health: list[Health]
    # From exposure to the newest pose's arrival here, ms; None where its stamp is no guide.
    latency_ms: dict[HandName, float | None]
    touches: Sequence[TouchView] = ()
    holds: Sequence[HoldView] = ()
    # Objects that were there and of which nothing comes any more: for how long, s.
    silent_s: Mapping[str, float] = field(default_factory=dict)
