"""Warming up compiles everything a live rig will call."""

from __future__ import annotations

from services.fusion import intake, patch, rest, ring
from services.fusion.synthetic import Path, Setup, frames, point_hands
from services.fusion.warm import warm_up

LIVE = (intake.take_in, intake.drop, rest.blend, ring.query_all, ring.start)


def test_warming_up_exercises_the_whole_of_fusion():
    setup = Setup(cameras=3)
    assert warm_up(setup.config(), setup.rig(), point_hands()) == 8
    for compiled in (*LIVE, patch.located_shift, patch._fill):
        assert compiled.signatures, compiled


def test_after_warming_up_nothing_new_is_compiled(fuse):
    setup = Setup()
    warm_up(setup.config(), setup.rig(), point_hands())
    before = [len(compiled.signatures) for compiled in LIVE]
    fuse(setup, frames(setup, Path(), 0.5))
    assert before == [len(compiled.signatures) for compiled in LIVE]
