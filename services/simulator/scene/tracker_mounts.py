"""How a simulated Vive tracker sits on its object, and where the lighthouse is. Pure data.

This is the truth of a simulated rig. calibration/objects.json says it too where this tool wrote the
file (files/make_calibration.py); what `rhot calibrate objects` wrote is an estimate, which the
simulator does not believe.
"""

from __future__ import annotations

import numpy as np

from rhot.files.calibration import ObjectPlace, Objects
from rhot.files.rig_tables import ObjectTable
from rhot.geometry.meshes import Mesh
from rhot.geometry.solids import Box, Cylinder, Solid
from rhot.geometry.transforms import Array, rotation_x, rotation_y, transform

# A Vive tracker 3.0 (HTC: 70.9 x 79.0 x 44.1 mm) as a puck. Its frame here: origin in the middle of
# its base, z out of its top.
PUCK_HEIGHT_M, PUCK_RADIUS_M = 0.044, 0.0355
# The paint is a painted bead on its top, sunk in a little: a disc to cameras on nearly all sides,
# as large as the wrist's dab.
BEAD_RADIUS_M = 0.009
_BEAD_M = (0.0, 0.0, 0.052)
# From the middle of an object without a shape to its tracker.
_PLAIN_HALF_M = 0.075
# T_rig_from_lighthouse: y up, behind and beside the hand, as a wall would have it.
LIGHTHOUSE: Array = transform(
    rotation_x(np.pi) @ rotation_y(0.6) @ rotation_x(0.15), (0.6, 0.9, 1.4)
)
_HALF_TURN = 0.70710678
# What `rhot calibrate objects` signs its files with.
_ESTIMATOR = "rhot calibrate"


def is_puck(table: ObjectTable) -> bool:
    """Whether an object's tracker is drawn as one.

    An object of which rig.toml says nothing keeps the simple look of earlier versions.
    """
    return bool(table.shape or table.marker)


def simulated_place(table: ObjectTable, solid: Solid | None) -> ObjectPlace:
    """How the tracker is fixed to an object: at the low end of y, its top away from it."""
    if not is_puck(table):
        return ObjectPlace(
            offset_m=(_PLAIN_HALF_M, 0.0, 0.0),
            orientation_wxyz=(_HALF_TURN, 0.0, 0.0, -_HALF_TURN),
        )
    # The object's y is the tracker's -z.
    return ObjectPlace(
        offset_m=(0.0, 0.0, round(-below_m(solid), 6)),
        orientation_wxyz=(_HALF_TURN, -_HALF_TURN, 0.0, 0.0),
        marker_m=_BEAD_M if table.marker else None,
    )


def bead_m(place: ObjectPlace) -> tuple[float, float, float]:
    """Middle of the paint on a tracker, in its frame."""
    return place.marker_m or _BEAD_M


def below_m(solid: Solid | None) -> float:
    """How far an object reaches from its origin towards -y."""
    if isinstance(solid, Box):
        return 0.5 * solid.size_m[1]
    if isinstance(solid, Cylinder):
        return 0.5 * solid.height_m
    if isinstance(solid, Mesh):
        return -float(solid.vertices_m[np.unique(solid.faces), 1].min())
    return _PLAIN_HALF_M if solid is None else solid.reach_m


def believed(objects: Objects | None) -> Objects | None:
    """objects.json if it holds the truth of this rig: not one that somebody's tool estimated."""
    if objects is None or objects.tool.startswith(_ESTIMATOR):
        return None
    return objects
