"""Where the rig stands in another program."""

from __future__ import annotations

import pytest

from rhot.files.bridge_tables import Vmc
from services.bridges.placement import placement_of


@pytest.mark.parametrize(
    ("up", "up_in_rig"),
    [
        ("x", (1, 0, 0)),
        ("-x", (-1, 0, 0)),
        ("y", (0, 1, 0)),
        ("-y", (0, -1, 0)),
        ("z", (0, 0, 1)),
        ("-z", (0, 0, -1)),
    ],
)
def test_what_is_up_in_the_rig_is_up_there(up, up_in_rig):
    placement = placement_of(Vmc(up=up, yaw_deg=37.0, position_m=(1.0, 2.0, 3.0)))
    assert placement.direction(up_in_rig) == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
    assert placement.point(up_in_rig) == pytest.approx((1.0, 3.0, 3.0))


def test_a_camera_that_looks_at_somebody_shows_their_left_to_its_right():
    placement = placement_of(Vmc())
    x, y, z = placement.point((0.1, 0.0, 0.5))
    # In front of the person, who looks towards -z.
    assert (x, y, z) == pytest.approx((-0.1, 0.8, -0.4))
    same_way = placement_of(Vmc(yaw_deg=0.0, position_m=(0.0, 1.0, 0.0)))
    assert same_way.point((0.1, 0.2, 0.5)) == pytest.approx((0.1, 0.8, -0.5))
    assert same_way.orientation((1.0, 0.0, 0.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0, 0.0))
