"""A measured hand, judged and told in plain words. Pure."""

from __future__ import annotations

from services.calibrator.guided.found import Found, figure
from services.calibrator.output.hand_file import HandFile

# What is left between a hand and its points, per coordinate, m: simulated exercises of three hands
# with 1 mm of noise leave .83 to .87 mm. More than twice that was not seen well, or not followed.
_RESIDUAL_M = 2e-3
# Of a length that the data determine, one standard deviation, m: 2.5 to 2.8 mm for the same hands.
_SIGMA_M = 4e-3
# A finger that bends less than this at its knuckle, deg, tells little of its bones.
_BEND_DEG = 40.0


def hand_found(made: HandFile) -> Found:
    """What the page says of a hand of the exercises."""
    known = [one for one in made.lengths if one.source in ("data", "by hand")]
    partly = [one for one in made.lengths if one.source == "partly"]
    worst = max((one.sigma_m for one in known), default=0.0)
    advice = []
    if made.residual_m > _RESIDUAL_M:
        advice.append(
            "The hand does not fit its points well: do the exercises again, slower, with the palm "
            "towards both cameras."
        )
    if not known:
        advice.append("No length could be measured: bend the fingers farther, one after the other.")
    elif worst > _SIGMA_M:
        advice.append("Some lengths are uncertain: do the exercises again, and bend farther.")
    lazy = [name for name, angle in made.reached_deg.items() if angle < _BEND_DEG]
    if lazy:
        advice.append(f"Hardly bent: {', '.join(lazy)}. Bend these farther the next time.")
    good = made.residual_m <= _RESIDUAL_M and bool(known) and worst <= _SIGMA_M
    return Found(
        files={f"hand.{made.hand}.json": made},
        good=good,
        figures=[
            figure("left between hand and paint", f"{1e3 * made.residual_m:.2f} mm"),
            figure("lengths measured", f"{len(known)} of {len(made.lengths)}"),
            figure("partly measured", str(len(partly))),
            figure("the least certain of them", f"± {1e3 * worst:.1f} mm"),
            figure("pictures used", str(made.frames)),
        ],
        advice=advice,
    )
