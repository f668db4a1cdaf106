"""How the solution of one digit ended: the codes that every method's kernel returns."""

from __future__ import annotations

# SOLVED: within tolerance. UNREACHABLE: the nearest posture. NOT_CONVERGED: no solution, either
# because the iterations were used up or because the target is not finite.
SOLVED, UNREACHABLE, NOT_CONVERGED = 0, 1, 2
