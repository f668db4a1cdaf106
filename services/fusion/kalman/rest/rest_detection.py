"""Which markers of a hand rest, so that they move as one rigid body (rigid_body.py).

Nobody holds a hand still: it sways by millimetres within a second, so a landmark by itself cannot
be averaged for longer. But the sway is common: six markers tell a body's six degrees of freedom
several times better than any of them tells its own motion, and what is left, the hand's shape,
hardly changes. Rendered hands at rest at 1.0 m, without lag: depth scatters by 1.7 mm if every
landmark is filtered by itself, by .9 so. A common translation without rotation does little, as a
hand sways about its wrist.

Whether a marker rests is a hypothesis test, marker by marker: the likelihood of its observations in
the body against that in its own track (track_history.py). One that moves by itself does not update
the body. In a trial every TRIAL_S it is anchored anew and gets another chance; and where fewer than
three rest, the body starts anew with all of them, so that rest is found soon after it comes.

Observations may be late by REACH_S, and estimates may be asked for so long before and after the
latest one. Compiled; nothing here raises. kalman/estimator.py owns the arrays.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Ints
from services.fusion.geometry.projection import Extrinsics
from services.fusion.intake.frame_rays import FrameRays, Observation, observation
from services.fusion.kalman.measurement import Measurement
from services.fusion.kalman.rest.body_update import update_body
from services.fusion.kalman.rest.rigid_body import RestState, advance_body, is_lost, start_body
from services.fusion.kalman.track_history import TrackHistory, filtered, newest_node
from services.fusion.kalman.track_insertion import ACCEPTED

# So many markers tell how a body translates and rotates.
BODY_MARKERS = 3
# A marker likelier at rest than this updates the body and profits from it.
REST_THRESHOLD = 0.3
# Markers that do not rest are anchored anew so often, and a body with fewer than BODY_MARKERS that
# rest starts anew: a trial.
TRIAL_S = 0.5
# Prior probability of rest of a marker met for the first time, and the share of probability that
# returns to it at each observation.
PRIOR, LEAK = 0.1, 0.003
# One observation speaks against rest by no more than this (log-likelihood): what background and
# light do to a centre is no motion. Three in a row outweigh all before. Without a limit still depth
# is up to 5 % worse; with 1.5, playing fingers are 3 % worse.
MAX_EVIDENCE_AGAINST = 2.0
# Probability of rest counts once it has lasted: a hand that turns back rests for an instant.
RISE_S = 0.3
# Squared Mahalanobis distance (2 degrees of freedom) beyond which a ray updates neither body nor
# anchor.
BODY_GATE = 30.0
# Motion is extrapolated over this much at most.
REACH_S = 0.1
# Without an observation of a marker for longer than the first, its share of the body's estimate
# fades with the second.
FRESH_S, FADE_S = 0.05, 0.1


@njit(cache=True, error_model="numpy")
def update_rest(
    rest: RestState, history: TrackHistory, frame: FrameRays, codes: Ints, cameras: Extrinsics
) -> None:
    """Take in those of a frame's observations that their tracks have just ACCEPTED (codes (n,))."""
    for hand in range(rest.time_s.shape[0]):
        if _advance_to_frame(rest, history, hand, frame, codes):
            _update_hand(rest, history, hand, frame, codes, cameras)
        else:
            # What comes too late for the body is in the tracks, which then know better.
            for n in range(codes.shape[0]):
                if rest.hand[frame.landmarks[n]] == hand and codes[n] == ACCEPTED:
                    rest.sustained[frame.landmarks[n]] = 0.0


@njit(cache=True, error_model="numpy")
def _advance_to_frame(
    rest: RestState, history: TrackHistory, hand: int, frame: FrameRays, codes: Ints
) -> bool:
    """Predict a hand's body to the mean instant of a frame's observations.

    False if that is too long ago, or nothing of the hand is in the frame.
    """
    count = 0
    time_s = 0.0
    centre = np.zeros(3)
    for n in range(codes.shape[0]):
        landmark = frame.landmarks[n]
        if rest.hand[landmark] == hand and codes[n] == ACCEPTED:
            centre += filtered(history, landmark, newest_node(history, landmark), 0).mean[:3]
            time_s += frame.times_s[n]
            count += 1
    if count == 0:
        return False
    time_s /= count
    if time_s > rest.time_s[hand] + REACH_S or is_lost(rest, hand):
        start_body(rest, hand, time_s, centre / count)
    elif time_s > rest.time_s[hand]:
        advance_body(rest, hand, time_s)
        if time_s > rest.trial_s[hand] + TRIAL_S:
            _start_trial(rest, hand, time_s, centre / count)
    return bool(time_s >= rest.time_s[hand] - REACH_S)


@njit(cache=True, error_model="numpy")
def _start_trial(rest: RestState, hand: int, time_s: float, centre: Array) -> None:
    """Drop the anchors of markers that do not rest, and where too few rest the body.

    They are anchored anew at their next observations; a new body turns about centre (3,).
    """
    rest.trial_s[hand] = time_s
    if _count_resting(rest, hand) < BODY_MARKERS:
        start_body(rest, hand, time_s, centre)
    for landmark in range(rest.hand.shape[0]):
        if rest.hand[landmark] == hand and rest.probability[landmark] < REST_THRESHOLD:
            rest.probability[landmark] = 0.0


@njit(cache=True, error_model="numpy")
def _count_resting(rest: RestState, hand: int) -> int:
    """How many markers of a hand are taken to rest."""
    count = 0
    for landmark in range(rest.hand.shape[0]):
        count += rest.hand[landmark] == hand and rest.probability[landmark] >= REST_THRESHOLD
    return count


@njit(cache=True, error_model="numpy")
def _update_hand(
    rest: RestState,
    history: TrackHistory,
    hand: int,
    frame: FrameRays,
    codes: Ints,
    cameras: Extrinsics,
) -> None:
    """Update one hand's body and its markers' probabilities of rest with a frame."""
    count = codes.shape[0]
    # In a trial, those update the body that have not been found to move.
    in_trial = _count_resting(rest, hand) < BODY_MARKERS
    threshold = 0.5 * PRIOR if in_trial else REST_THRESHOLD
    updates_body = np.zeros(count, dtype=np.bool_)
    for n in range(count):
        updates_body[n] = rest.probability[frame.landmarks[n]] >= threshold
    # The first to update the body is predicted worst and the others profit from it, so it is
    # another one each time; those that do not update it come last.
    rest.frames[hand] += 1
    for updating in (True, False):
        for k in range(count):
            n = (k + rest.frames[hand]) % count
            landmark = frame.landmarks[n]
            if rest.hand[landmark] == hand and codes[n] == ACCEPTED and updates_body[n] == updating:
                observed = observation(frame, n)
                _update_rest_probability(rest, history, landmark, observed, cameras, updating)


@njit(cache=True, error_model="numpy")
def _update_rest_probability(
    rest: RestState,
    history: TrackHistory,
    landmark: int,
    observed: Observation,
    cameras: Extrinsics,
    updates_body: bool,
) -> None:
    """Bayes' rule for one marker: does this observation fit the body, or rather its own track?"""
    if rest.probability[landmark] == 0.0:
        _place_anchor(rest, history, landmark)
        rest.probability[landmark] = PRIOR
        rest.sustained[landmark] = 0.0
    else:
        measured = Measurement(
            cameras.R[observed.camera],
            cameras.t[observed.camera],
            observed.ray,
            observed.ray_variance,
            observed.clock_variance,
        )
        dt_s = observed.time_s - rest.time_s[rest.hand[landmark]]
        log_likelihood = update_body(rest, landmark, dt_s, measured, updates_body, BODY_GATE)
        log_ratio = log_likelihood - history.log_likelihood[landmark]
        prior = (1.0 - LEAK) * rest.probability[landmark] + LEAK * PRIOR
        odds = prior / (1.0 - prior) * math.exp(min(max(log_ratio, -MAX_EVIDENCE_AGAINST), 50.0))
        rest.probability[landmark] = odds / (1.0 + odds)
        elapsed_s = max(observed.time_s - rest.observed_s[landmark], 0.0)
        rest.sustained[landmark] = min(
            rest.probability[landmark], rest.sustained[landmark] + elapsed_s / RISE_S
        )
    rest.observed_s[landmark] = max(observed.time_s, rest.observed_s[landmark])


@njit(cache=True, error_model="numpy")
def _place_anchor(rest: RestState, history: TrackHistory, landmark: int) -> None:
    """Place a marker in its body where the likeliest model of its track has it."""
    node = newest_node(history, landmark)
    m = int(np.argmax(history.probability[landmark, node]))
    state = filtered(history, landmark, node, m)
    since_s = history.time_s[landmark, node] - rest.time_s[rest.hand[landmark]]
    for i in range(3):
        rest.anchor[landmark, i] = state.mean[i] - since_s * state.mean[3 + i]
        for j in range(3):
            rest.anchor_cov[landmark, i, j] = state.cov[i, j]
