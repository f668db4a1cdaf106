"""Which of several motion models is right: their probabilities, and who goes on from whom.

Each model takes an observation, or passes it over as another thing's (gate); that costs it
likelihood, but nothing else. So a calm model stays where it was when a wild ray comes, while a
lively one follows a hand that turns sharply, and the next observations tell which of them was
right. Until then the mixture of both says how little is known. A model that keeps passing over what
the likeliest one takes is wrong about where the landmark is: it goes on from the likeliest.
Compiled; nothing here raises.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rhot.geometry.transforms import Array
from services.fusion.arrays import Bools, Ints
from services.fusion.kalman.measurement import NOT_VISIBLE

# Share of probability that leaks to the other models at each observation; keeps every model ready
# to take over within an observation or two.
LEAK = 0.003
# Log-density (of a ray, units of x/z and y/z) of an observation that is passed over: of one in a
# hundred, spread over a tenth of a radian.
PASSED_OVER = 0.0
# Passing over what the likeliest model took counts STRIKE, taking an observation takes one back; at
# OUT a model is out: twice running, or three times every other one. Once may be due to another
# thing; a model that is off in depth fits one camera always and the other never. Going on from the
# likeliest wherever that is the likelier way to be in a model now (Viterbi's) instead: maxima at
# lag 2 of the glove 40 for 24 mm, errors of taps 15 % larger; no difference elsewhere.
STRIKE, OUT = 2, 4


@njit(cache=True, error_model="numpy")
def update_probabilities(prior: Array, log_likelihoods: Array, posterior: Array) -> float:
    """Bayes' rule over models (M,), written to posterior (M,); returns the total log-likelihood."""
    models = prior.shape[0]
    best = NOT_VISIBLE
    for m in range(models):
        if log_likelihoods[m] > best:
            best = log_likelihoods[m]
    total = 0.0
    for m in range(models):
        leaked = (1.0 - LEAK) * prior[m] + LEAK / models
        posterior[m] = leaked * math.exp(max(log_likelihoods[m] - best, -700.0))
        total += posterior[m]
    posterior /= total
    return best + math.log(total)


@njit(cache=True, error_model="numpy")
def count_strikes(before: Ints, took: Bools, likeliest: int, after: Ints) -> None:
    """How often each model (M,) has passed over lately what the likeliest took.

    before, after: the counts at the last observation and at this one, which those models took (M,).
    """
    for m in range(took.shape[0]):
        after[m] = 0 if before[m] >= OUT else before[m]
        if took[m]:
            after[m] = max(0, after[m] - 1)
        elif took[likeliest]:
            after[m] += STRIKE


@njit(cache=True, error_model="numpy")
def choose_parents(probability: Array, strikes: Ints, parent: Ints) -> None:
    """From which model's estimate each model (M,) goes on: its own, or the likeliest's if out."""
    likeliest = int(np.argmax(probability))
    for m in range(probability.shape[0]):
        parent[m] = likeliest if strikes[m] >= OUT else m
