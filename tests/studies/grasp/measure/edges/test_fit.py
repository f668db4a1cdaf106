"""A chain laid into edges of which the truth is known: points, not pictures."""

from __future__ import annotations

import numpy as np
import pytest

from rhot.errors import CaptureError
from studies.grasp.measure.edges.fit import Chain, Outline, fit, joints_of, within_limits
from studies.grasp.measure.edges.outline import (
    Link,
    Side,
    first_widths,
    learn_link,
    links_of,
    refined_widths,
    tip_end,
)
from studies.grasp.measure.edges.paper import centroids, side_lines
from studies.grasp.measure.edges.segments import Edges

LENGTHS = [100.0, 60.0, 45.0]
WIDTHS = np.array([[-24.0, -20.0, -16.0, -13.0], [24.0, 20.0, 16.0, 13.0]])
NAMES = ["index_mcp", "index_pip", "index_dip", "index_tip"]
OUTLINE = Outline(None, links_of(WIDTHS, LENGTHS), 55.0)


def chain_at(*turns_deg, at=(200.0, 150.0)):
    return Chain(np.array(at), np.cumsum(np.radians(turns_deg)))


def edges_of(chain, *, sides=(0, 1), noise=0.4, clutter=0, outline=OUTLINE):
    """Edge pixels along the outline, each link's middle part; clutter: others, anywhere."""
    rng = np.random.default_rng(8)
    points, directions = [], []
    joints = joints_of(outline, chain)
    for k, link in enumerate(outline.phalanges):
        u = np.array([np.cos(chain.directions[k]), np.sin(chain.directions[k])])
        n = np.array([-u[1], u[0]])
        along = np.linspace(0.1, 0.9, round(link.length))
        for number in sides:
            side = link.sides[number]
            across = side.start + (side.end - side.start) * along + rng.normal(0, noise, len(along))
            points.append(joints[k] + np.outer(along * link.length, u) + np.outer(across, n))
            directions.append(np.tile(u, (len(along), 1)))
    across = np.linspace(-6.0, 6.0, 13)
    points.append(joints[2] + np.outer(55.0 - across**2 / 29.0, u) + np.outer(across, n))
    directions.append(np.tile(n, (13, 1)))
    if clutter:
        points.append(rng.uniform((150, 80), (450, 350), (clutter, 2)))
        angle = rng.uniform(0, np.pi, clutter)
        directions.append(np.stack([np.cos(angle), np.sin(angle)], axis=1))
    points, directions = np.concatenate(points), np.concatenate(directions)
    return Edges(points, directions, np.ones(len(points)))


@pytest.mark.parametrize("truth", [(5, 10, 5), (20, 50, 30), (60, 95, 60)])
@pytest.mark.parametrize("clutter", [0, 250])
def test_angles_are_found_from_a_prediction_that_is_off(truth, clutter):
    true = chain_at(*truth)
    predicted = chain_at(truth[0] - 4, truth[1] - 5, truth[2] - 4, at=(203.0, 148.0))
    fitted = fit(edges_of(true, clutter=clutter), OUTLINE, predicted, 1)
    error = np.degrees(fitted.chain.directions - true.directions)
    assert np.abs(error).max() < (1.5 if clutter else 1.0)
    assert np.abs(fitted.chain.mcp - true.mcp).max() < 1.5
    assert fitted.cover.min() > 0.8
    told = np.degrees(np.sqrt(np.diag(fitted.cov)[2:]))
    assert np.all((told > 0.1) & (told < 3.0))


def test_one_side_is_enough():
    true = chain_at(20, 50, 30)
    fitted = fit(edges_of(true, sides=(0,)), OUTLINE, chain_at(18, 47, 28), 1)
    assert np.abs(np.degrees(fitted.chain.directions - true.directions)).max() < 2.0
    assert fitted.cover[:, 1].max() < 0.2


def test_without_edges_the_prediction_stands_and_nothing_is_covered():
    none = Edges(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
    predicted = chain_at(20, 50, 30)
    fitted = fit(none, OUTLINE, predicted, 1)
    assert fitted.chain.directions == pytest.approx(predicted.directions)
    assert fitted.cover.max() == 0.0


@pytest.mark.parametrize("side", [1, -1])
def test_no_finger_bends_backwards(side):
    bent = within_limits(side * np.radians((0.0, -60.0, 200.0)), side)
    turns = np.degrees(side * np.diff(bent))
    assert turns == pytest.approx((-20.0, 105.0))
    inside = side * np.radians((0.0, 30.0, 70.0))
    assert within_limits(inside, side) == pytest.approx(inside)


def test_the_outline_is_learned_beside_the_seeds():
    edges = edges_of(chain_at(3, 12, 8))
    joints = joints_of(OUTLINE, chain_at(3, 12, 8))
    widths = first_widths(edges, joints, NAMES)
    for _ in range(4):
        widths = refined_widths(edges, joints, widths)
    assert widths == pytest.approx(WIDTHS, abs=0.8)
    link = links_of(widths, LENGTHS)[2]
    assert tip_end(edges, joints[2], joints[3], link) == pytest.approx(55.0, abs=1.5)
    assert learn_link(edges, joints[0] + 300.0, joints[1] + 300.0).sides == (None, None)


def test_seeds_beside_the_finger_are_told():
    edges = edges_of(chain_at(3, 12, 8))
    joints = joints_of(OUTLINE, chain_at(3, 12, 8))
    with pytest.raises(CaptureError, match="no finger is seen beside the line"):
        first_widths(edges, joints + np.array([0.0, 150.0]), NAMES)
    with pytest.raises(CaptureError, match="one of them is off the finger"):
        first_widths(edges, joints + np.array([0.0, 20.0]), NAMES)


def test_the_papers_regions_lie_about_the_joints():
    true = chain_at(10, 40, 25)
    edges = edges_of(true)
    fitted = fit(edges, OUTLINE, true, 1)
    assert set(side_lines(edges, OUTLINE, fitted)) == {(k, n) for k in range(3) for n in (0, 1)}
    for centroid, joint in zip(
        centroids(edges, OUTLINE, fitted), joints_of(OUTLINE, true), strict=True
    ):
        assert np.hypot(*(centroid - joint)) < 4.0
    one_side = edges_of(true, sides=(0,))
    assert centroids(one_side, OUTLINE, fit(one_side, OUTLINE, true, 1)) == [None] * 4


def test_a_link_knows_its_width():
    assert Link(80.0, (Side(-20.0, -16.0), None)).width == pytest.approx(18.0)
    assert Link(80.0, (None, None)).width == pytest.approx(20.0)
