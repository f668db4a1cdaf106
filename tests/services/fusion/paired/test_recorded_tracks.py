"""The paths of a recording: still and fast windows, and what is left out."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from services.fusion.paired.recorded_tracks import seconds_of, tracks


def test_still_and_fast_windows_are_told_apart(recording):
    found = tracks(recording(4.0, 6.0))
    assert len(found) == 2
    for track in found:
        assert not (track.still & track.fast).any()
        assert track.still[track.times_s < 3.5].all()
        assert track.fast[track.times_s > 4.5].mean() > 0.7
        assert seconds_of(track.times_s, track.still) == pytest.approx(4.0, abs=0.6)


def test_samples_that_come_twice_or_go_back_in_time_are_left_out(recording):
    messages = list(recording(2.0, 2.0))
    late = msgspec.structs.replace(messages[50], stamp_ns=messages[40].stamp_ns)
    messages[50:51] = [messages[50], messages[50], late]
    track = tracks(messages)[0]
    assert len(track.times_s) == 120
    assert (np.diff(track.times_s) > 0.0).all()


def test_short_tracks_and_predicted_points_are_left_out(recording):
    assert tracks(recording(0.5, 0.4)) == []
    assert tracks(recording(5.0, 5.0, source="predicted")) == []


def test_seconds_count_between_neighbours_that_are_both_chosen():
    times_s = np.array([0.0, 1.0, 2.0, 4.0])
    chosen = np.array([True, True, False, True])
    assert seconds_of(times_s, chosen) == 1.0
    assert seconds_of(times_s[:1], chosen[:1]) == 0.0
