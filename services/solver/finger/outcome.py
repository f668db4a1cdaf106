"""How the solution of one digit ended: the codes that every method's kernel returns."""

from __future__ import annotations

from rhot.messages import FingerStatus

# SOLVED: within tolerance. UNREACHABLE: the nearest posture. NOT_CONVERGED: no solution, either
# because the iterations were used up or because the target is not finite. NOT_SEEN: no camera saw
# the tip.
SOLVED, UNREACHABLE, NOT_CONVERGED, NOT_SEEN = 0, 1, 2, 3
# What HandPose calls them.
STATUSES: tuple[FingerStatus, ...] = ("solved", "unreachable", "not_converged", "predicted")
