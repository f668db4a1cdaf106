"""Scores as text tables. Numbers that were not measured show as `-`."""

from __future__ import annotations

from services.cli.evaluate.contacts.score_contacts import contacts_text
from services.cli.evaluate.score_types import (
    Coverage,
    HandScore,
    ObjectScore,
    PointError,
    Score,
    Spread,
    Stages,
)
from services.cli.evaluate.text_table import number, plain, table

# Bias and RMS along each axis, RMS and maximum of the length, as in PointError; all in mm.
_POINT_COLUMNS = ("bias x", "bias y", "bias z", "RMS x", "RMS y", "RMS z", "RMS mm", "max mm")
_MARKER_COLUMNS = ("found %", "strays", "bias x", "bias y", "RMS x", "RMS y px")


def score_text(score: Score) -> str:
    """The whole of a score."""
    parts = [hand_text(hand, one) for hand, one in score.hands.items()]
    if score.objects:
        parts.append(objects_text(score.objects))
    if score.contacts:
        parts.append(contacts_text(score.contacts))
    parts += [stages_text(hand, one) for hand, one in score.stages.items()]
    parts += [f"note: {note}" for note in score.notes]
    return "\n\n".join(parts)


def hand_text(hand: str, score: HandScore) -> str:
    """One hand: tips, angles, orientation, dropouts, limits, delay."""
    count = f"{score.scored} of {score.poses} poses inside the truth"
    if score.predicted:
        count += f", {score.predicted} with a predicted finger"
    points = [(name, *_point(error)) for name, error in score.tips.items()]
    points.append(("wrist", *_point(score.wrist)))
    angles = [
        (
            f"{digit} {joint}",
            number(error.bias_deg, 1),
            number(error.mean_deg, 1),
            number(error.max_deg, 1),
        )
        for digit, joints in score.angles.items()
        for joint, error in joints.items()
        if not error.fixed
    ]
    return "\n\n".join(
        [
            f"{hand} hand: {count}",
            table(("point", *_POINT_COLUMNS), points),
            table(("angle", "bias", "mean", "max deg"), angles),
            plain(_overview(score)),
        ]
    )


def objects_text(objects: dict[str, ObjectScore]) -> str:
    """How large each object's errors are, then what else there is to say of it."""
    sizes = [
        (f"{name}, {unit}", *_sizes(spread))
        for name, one in objects.items()
        for unit, spread in (
            ("mm", one.position_mm),
            ("deg", one.orientation_deg),
            ("mm/s", one.velocity_mm_s),
        )
    ]
    return "\n\n".join(
        [
            table(("object", "median", "RMS", "95 %", "max"), sizes),
            plain([line for name, one in objects.items() for line in _object(name, one)]),
        ]
    )


def _sizes(spread: Spread | None) -> list[str]:
    if spread is None:
        return ["-"] * 4
    return [number(value) for value in (spread.median, spread.rms, spread.p95, spread.max)]


def _object(name: str, score: ObjectScore) -> list[tuple[str, str, str]]:
    """(what, value, remark) of an object's poses."""
    others = [
        f"{count} {state.replace('_', ' ')}"
        for state, count in sorted(score.states.items())
        if state != "ok"
    ]
    if score.unregistered:
        others.append(f"{score.unregistered} not registered")
    count = f"{score.scored} of {score.poses} poses scored"
    missed = f"{100 * score.coverage.missed_share:.1f} %"
    bias = score.position.bias_mm if score.position else (None, None, None)
    late = "" if score.latency_ms is None else f"sent {score.latency_ms:.1f} ms after their stamps"
    return [
        (f"{name}, ok", f"{100 * score.ok_share:.1f} %", ", ".join([count, *others])),
        (f"{name}, dropouts", missed, _coverage_text(score.coverage)),
        (f"{name}, bias", " ".join(number(value) for value in bias), "mm, along x, y and z"),
        (f"{name}, delay", f"{number(score.delay_ms, 1)} ms", late or "of the content"),
    ]


def stages_text(hand: str, stages: Stages) -> str:
    """Markers and points, one row each."""
    markers = [
        (
            f"{camera} {name}",
            f"{100 * one.found_share:.1f}",
            str(one.strays),
            *(number(value) for value in (*one.bias_px, *one.rms_px)),
        )
        for camera, rows in stages.markers.items()
        for name, one in rows.items()
    ]
    points = [
        (
            name,
            f"{100 * one.found_share:.1f}",
            f"{100 * one.predicted_share:.1f}",
            *_point(one.error),
        )
        for name, one in stages.points.items()
    ]
    return "\n\n".join(
        [
            f"{hand} hand, markers against the projected truth:",
            table(("marker", *_MARKER_COLUMNS), markers),
            f"{hand} hand, points against the truth's landmarks:",
            table(("point", "found %", "pred. %", *_POINT_COLUMNS), points),
        ]
    )


def _overview(score: HandScore) -> list[tuple[str, str, str]]:
    """(what, value, remark) of what is one number for the whole hand."""
    turn, limits = score.orientation, score.violations
    turn_text = f"RMS; mean {turn.mean_deg:.2f}, max {turn.max_deg:.2f}"
    worst = f"worst {limits.worst_deg:.2f} deg at {limits.worst_joint}" if limits.count else "none"
    missed = f"{100 * score.coverage.missed_share:.1f} %"
    delay = "-" if score.delay_ms is None else f"{score.delay_ms:.1f} ms"
    return [
        ("finger tips, RMS", f"{score.tips_rms_mm:.2f} mm", f"at {score.distance_m:.2f} m"),
        ("joint angles, mean", f"{score.angles_mean_deg:.2f} deg", "fixed joints left out"),
        ("hand orientation", f"{turn.rms_deg:.2f} deg", turn_text),
        ("wrist position, RMS", f"{score.wrist.total_rms_mm:.2f} mm", ""),
        ("dropouts", missed, _coverage_text(score.coverage)),
        ("limit violations", str(limits.count), worst),
        ("delay", delay, "of the content; - if the motion is too slow to measure it"),
    ]


def _coverage_text(coverage: Coverage) -> str:
    gap = f"longest gap {coverage.longest_gap_ms:.0f} ms"
    text = f"{coverage.missed} of {coverage.expected} instants, {gap}"
    return text + (f", {coverage.outside} poses outside the truth" if coverage.outside else "")


def _point(error: PointError) -> list[str]:
    values = (*error.bias_mm, *error.rms_mm, error.total_rms_mm, error.max_mm)
    return [number(value) for value in values]
