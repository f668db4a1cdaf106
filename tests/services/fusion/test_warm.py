"""Warming up compiles everything a live rig will call."""

from __future__ import annotations

from services.fusion.alignment import height_memory, height_track
from services.fusion.intake import observations, ray_interpolation
from services.fusion.kalman import estimator, filtering, held
from services.fusion.monitors import (
    clock_offsets,
    epipolar_error,
    height_window,
    likeliest_clocks,
    mirrored_view,
    moved_camera,
    shift_regression,
)
from services.fusion.one_camera import carried_shape, last_located
from services.fusion.output import hand_points
from services.fusion.paint import hidden_paint, known_paint, paint_to_bone
from services.fusion.warm import warm_up
from testing.synthetic_points import MovingHand, SyntheticRig, frames, point_hands

LIVE = (
    held.take_looks,
    held.complete,
    held.filter_again,
    filtering.oldest_with,
    held.tell_all,
    estimator._keep_useful,
    carried_shape.carry_shape,
    last_located._note,
    hand_points._point_numbers,
    hidden_paint._compare,
    paint_to_bone.turn_with_joints,
    known_paint.note_directions,
    observations._observe,
    ray_interpolation.add_frame,
    epipolar_error._newest_errors,
    moved_camera._displaced,
    height_window._append,
    height_window._fit,
    shift_regression.fitted_shift,
    likeliest_clocks.likeliest_clocks,
    clock_offsets._running_mean,
    clock_offsets._pairing_sigma_s,
    height_memory.heights_by_landmark,
    mirrored_view._order,
    height_track._interpolate,
)


def test_warming_up_exercises_the_whole_of_fusion():
    setup = SyntheticRig(cameras=3)
    assert warm_up(setup.config(), setup.rig(), point_hands()) == 8
    for compiled in LIVE:
        assert compiled.signatures, compiled


def test_after_warming_up_nothing_new_is_compiled(fuse):
    setup = SyntheticRig()
    warm_up(setup.config(), setup.rig(), point_hands())
    before = [len(compiled.signatures) for compiled in LIVE]
    fuse(setup, frames(setup, MovingHand(), 3.5))
    assert before == [len(compiled.signatures) for compiled in LIVE]
