"""A second pose that explains the landmarks as well: followed beside the first until one has won.

Wrist and tips often leave two postures that differ by a turned palm. Which is right one message
cannot say, and a hand that changes its mind with a message jumps without having moved. So the rival
is followed like the pose itself, each from its own past, and the differences of their costs are
summed: it takes the pose's place only when it has been clearly better for a while, and until then
its share of the belief is in the covariance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from services.solver.whole_hand.hand_estimate import HandEstimate, offset

# Poses nearer than this (rad, of the wrist's turn and of each angle) are the same one.
SAME_TURN_RAD, SAME_ANGLE_RAD = 0.25, 0.35
# Logarithms of odds: below GIVE_UP_ODDS a rival is given up; beyond WIN_ODDS, for WIN_S on end, it
# has won. Leap recordings with the tables' bones: 5 restarts taken without motion at 6, 3 at 12.
GIVE_UP_ODDS, WIN_ODDS, WIN_S = -8.0, 12.0, 0.15
# Time in which evidence is forgotten: errors of bones are the same from message to message. .5 and
# 1 s change no count of jumps.
FORGETTING_S = 0.3
# Messages that follow each other sooner share their evidence: a frame at 30 Hz.
EVIDENCE_S = 0.033
# No single message says more than this.
MAX_EVIDENCE = 6.0


@dataclass(frozen=True)
class Rival:
    """The other pose, and the evidence for it."""

    estimate: HandEstimate
    odds: float  # logarithm, positive: likelier than the pose
    winning_s: float  # for how long they have been beyond WIN_ODDS

    def after(self, own: HandEstimate, rival: HandEstimate, seconds: float) -> Rival:
        """Both were followed for a message that came some seconds later."""
        evidence = 0.5 * (own.cost - rival.cost) * min(seconds / EVIDENCE_S, 1.0)
        evidence = min(max(evidence, -MAX_EVIDENCE), MAX_EVIDENCE)
        odds = math.exp(-seconds / FORGETTING_S) * self.odds + evidence
        return Rival(rival, odds, self.winning_s + seconds if odds > WIN_ODDS else 0.0)

    def has_won(self) -> bool:
        """Whether it is to take the pose's place."""
        return self.winning_s >= WIN_S

    def is_over(self, own: HandEstimate) -> bool:
        """Whether it need not be followed any more: unlikely, or the same pose by now."""
        return self.odds < GIVE_UP_ODDS or same_pose(own, self.estimate)

    def told(self, own: HandEstimate) -> HandEstimate:
        """The pose with a covariance about it that has the rival's share in it."""
        share = 1.0 / (1.0 + math.exp(-self.odds))
        off = offset(own, self.estimate)
        spread = self.estimate.covariance + np.outer(off, off)
        return own._replace(covariance=(1.0 - share) * own.covariance + share * spread)


def same_pose(a: HandEstimate, b: HandEstimate) -> bool:
    """Whether two estimates are of one pose."""
    off = offset(a, b)
    turned = float(np.linalg.norm(off[:3])) > SAME_TURN_RAD
    return not turned and float(np.abs(off[6:]).max()) <= SAME_ANGLE_RAD
