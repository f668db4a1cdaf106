"""A hand whose fingers rest moves as one rigid body (body.py): its markers share their motion, and
only their places are each one's own.

Nobody holds a hand still: it sways by millimetres within a second, so a landmark by itself cannot
be averaged for longer. But the sway is common: six markers tell a body's six degrees of freedom
several times better than any of them tells its own motion, and what is left, the hand's shape,
hardly changes. Rendered hands at rest at 1.0 m, without lag: depth scatters by 1.7 mm if every
landmark is filtered by itself, by .9 so. A common shift without turn does little, as a hand sways
about its wrist.

Whether a marker rests is decided by likelihood against the ring's models (ring.py), marker by
marker. One that moves by itself does not steer the body. Every TRIAL_S it is anchored anew and
given another chance; and where fewer than three rest, the body begins anew with all of them, so
that rest is found soon after it comes. Observations may be late by REACH_S, and estimates may be
asked for so long before and after the latest one. Compiled with numba; the arrays live in a Rest,
which kalman.py owns. Nothing here raises.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.kalman.rigid_body import Rest, advance, begin, look, lost, moved
from services.fusion.kalman.track_history import ACCEPTED, Ring
from services.fusion.method import Ints

# So many markers tell how a body moves and turns.
BODY = 3
# A marker likelier at rest than this steers the body and profits from it.
RESTS = 0.3
# Markers that do not rest are anchored anew so often, and a body with fewer than BODY that rest
# begins anew: a trial.
TRIAL_S = 0.5
# Belief in a marker met for the first time, and the share of belief that goes back there at each
# look.
FIRST, LEAK = 0.1, 0.003
# One look speaks against rest by no more than this (log-likelihood): what background and light do
# to a centre is no motion. Three in a row outweigh all before. Without a limit still depth is up to
# 5 % worse; with 1.5, playing fingers are 3 % worse.
DOUBT = 2.0
# Belief counts once it has lasted: a hand that turns back rests for an instant.
RISE_S = 0.3
# Innovations beyond this (2 degrees of freedom) do not steer the body.
GATE = 30.0
# Motion is extrapolated over this much at most.
REACH_S = 0.1
# Without a look at a marker for longer than the first, belief in its rest fades with the second.
FRESH_S, FADE_S = 0.05, 0.1


@njit(cache=True)
def _anchor(rest: Rest, ring: Ring, slot: int) -> None:
    """Put a marker where the likeliest of the ring's models has it."""
    node = ring.order[slot, ring.filled[slot] - 1]
    m = np.argmax(ring.belief[slot, node])
    since_s = ring.time_s[slot, node] - rest.time_s[rest.hand[slot]]
    for i in range(3):
        rest.anchor[slot, i] = (
            ring.state[slot, node, m, i] - since_s * ring.state[slot, node, m, 3 + i]
        )
        for j in range(3):
            rest.anchor_cov[slot, i, j] = ring.cov[slot, node, m, i, j]


@njit(cache=True)
def _judge(
    rest: Rest,
    ring: Ring,
    slot: int,
    time_s: float,
    seen: Array,
    variances: Array,
    R: Array,
    t: Array,
    steers: bool,
) -> None:
    """Take one observation in, and weigh anew whether its marker rests."""
    if rest.belief[slot] == 0.0:
        _anchor(rest, ring, slot)
        rest.belief[slot], rest.trust[slot] = FIRST, 0.0
    else:
        likelihood = look(
            rest, slot, time_s - rest.time_s[rest.hand[slot]], seen, variances, R, t, steers, GATE
        )
        before = (1.0 - LEAK) * rest.belief[slot] + LEAK * FIRST
        odds = (
            before
            / (1.0 - before)
            * math.exp(min(max(likelihood - ring.evidence[slot], -DOUBT), 50.0))
        )
        rest.belief[slot] = odds / (1.0 + odds)
        rest.trust[slot] = min(
            rest.belief[slot], rest.trust[slot] + max(time_s - rest.seen_s[slot], 0.0) / RISE_S
        )
    rest.seen_s[slot] = max(time_s, rest.seen_s[slot])


@njit(cache=True)
def _resting(rest: Rest, hand: int) -> int:
    """How many markers of a hand are taken to rest."""
    count = 0
    for slot in range(rest.hand.shape[0]):
        count += rest.hand[slot] == hand and rest.belief[slot] >= RESTS
    return count


@njit(cache=True)
def _try_again(rest: Rest, hand: int, time_s: float, centre: Array) -> None:
    """Begin a trial: new anchors for those that do not rest, and a new body about a point (3,)
    where too few do.
    """
    rest.trial_s[hand] = time_s
    if _resting(rest, hand) < BODY:
        begin(rest, hand, time_s, centre)
    for slot in range(rest.hand.shape[0]):
        if rest.hand[slot] == hand and rest.belief[slot] < RESTS:
            rest.belief[slot] = 0.0


@njit(cache=True)
def _ready(rest: Rest, ring: Ring, hand: int, slots: Ints, times_s: Array, codes: Ints) -> bool:
    """Bring a hand to the mean instant of a frame's observations.

    False if that is too long ago, or nothing of the hand is in it.
    """
    count, time_s, middle = 0, 0.0, np.zeros(3)
    for n in range(slots.shape[0]):
        if rest.hand[slots[n]] == hand and codes[n] == ACCEPTED:
            middle += ring.state[slots[n], ring.order[slots[n], ring.filled[slots[n]] - 1], 0, :3]
            time_s += times_s[n]
            count += 1
    if count == 0:
        return False
    time_s /= count
    if time_s > rest.time_s[hand] + REACH_S or lost(rest, hand):
        begin(rest, hand, time_s, middle / count)
    elif time_s > rest.time_s[hand]:
        advance(rest, hand, time_s)
        if time_s > rest.trial_s[hand] + TRIAL_S:
            _try_again(rest, hand, time_s, middle / count)
    return bool(time_s >= rest.time_s[hand] - REACH_S)


@njit(cache=True)
def weigh(
    rest: Rest,
    ring: Ring,
    slots: Ints,
    times_s: Array,
    codes: Ints,
    camera: int,
    rays: Array,
    variances: Array,
    R: Array,
    t: Array,
) -> None:
    """One camera's observations (n,) that the ring has just ACCEPTED.

    Arguments as of intake.take_in.
    """
    count, steers = slots.shape[0], np.zeros(slots.shape[0], dtype=np.bool_)
    for hand in range(rest.time_s.shape[0]):
        if not _ready(rest, ring, hand, slots, times_s, codes):
            # What comes too late for the body is in the ring, which then knows better.
            for n in range(count):
                if rest.hand[slots[n]] == hand and codes[n] == ACCEPTED:
                    rest.trust[slots[n]] = 0.0
            continue
        # In a trial, those that have not been found to move.
        enough = RESTS if _resting(rest, hand) >= BODY else 0.5 * FIRST
        for n in range(count):
            steers[n] = rest.belief[slots[n]] >= enough
        # The first to steer is predicted worst and the others profit from it, so it is another one
        # each time; those that do not come last.
        rest.frames[hand] += 1
        for steering in (True, False):
            for k in range(count):
                n = (k + rest.frames[hand]) % count
                if rest.hand[slots[n]] == hand and codes[n] == ACCEPTED and steers[n] == steering:
                    _judge(
                        rest,
                        ring,
                        slots[n],
                        times_s[n],
                        rays[n],
                        variances[n],
                        R[camera],
                        t[camera],
                        steering,
                    )


@njit(cache=True)
def blend(
    rest: Rest, time_s: float, found: npt.NDArray[np.bool_], means: Array, covs: Array
) -> None:
    """Mix what the ring tells of landmarks at an instant, (S, 6) and (S, 6, 6), with their places
    in a resting hand, in place.
    """
    J, D, place = np.empty((3, 6)), np.empty((3, 18)), np.empty(3)
    for slot in range(rest.hand.shape[0]):
        later_s = time_s - rest.time_s[rest.hand[slot]]
        if not (found[slot] and rest.trust[slot] > RESTS and abs(later_s) <= REACH_S):
            continue
        # From nothing at RESTS: a body that is far off must not even add to the spread of those
        # that move by themselves.
        share = (
            (rest.trust[slot] - RESTS)
            / (1.0 - RESTS)
            * math.exp(-max(time_s - rest.seen_s[slot] - FRESH_S, 0.0) / FADE_S)
        )
        moved(rest, slot, later_s, place, J)
        D[:, :6], D[:, 6:12], D[:, 12:] = J, later_s * J, 0.5 * later_s * later_s * J
        cov = D @ rest.cov[rest.hand[slot]] @ D.T + rest.anchor_cov[slot]
        for i in range(3):
            for j in range(3):
                apart = (place[i] - means[slot, i]) * (place[j] - means[slot, j])
                covs[slot, i, j] += share * (
                    0.5 * (cov[i, j] + cov[j, i]) - covs[slot, i, j] + (1.0 - share) * apart
                )
        for i in range(3):
            means[slot, i] += share * (place[i] - means[slot, i])
