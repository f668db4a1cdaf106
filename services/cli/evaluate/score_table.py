"""Scores as text: plain tables that line up in a terminal, a log or a mail.

Numbers that were not measured show as `-`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from services.cli.evaluate.score_types import (
    Coverage,
    HandScore,
    ObjectScore,
    PointError,
    Score,
    Stages,
)


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Columns as wide as their widest cell: the first to the left, the others to the right."""
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(header))]
    lines = [
        "  ".join(
            [
                row[0].ljust(widths[0]),
                *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True)),
            ]
        ).rstrip()
        for row in cells
    ]
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)


def score_text(score: Score) -> str:
    """The whole of a score."""
    parts = [hand_text(hand, one) for hand, one in score.hands.items()]
    if score.objects:
        parts.append(objects_text(score.objects))
    parts += [stages_text(hand, one) for hand, one in score.stages.items()]
    parts += [f"note: {note}" for note in score.notes]
    return "\n\n".join(parts)


def hand_text(hand: str, score: HandScore) -> str:
    """One hand: tips, angles, orientation, dropouts, limits, delay."""
    tips = [(name, *_point(error)) for name, error in {**score.tips, "wrist": score.wrist}.items()]
    angles = [
        (
            f"{digit} {joint}",
            _number(error.bias_deg, 1),
            _number(error.mean_deg, 1),
            _number(error.max_deg, 1),
        )
        for digit, joints in score.angles.items()
        for joint, error in joints.items()
        if not error.fixed
    ]
    lines = [
        ("finger tips, RMS", f"{score.tips_rms_mm:.2f} mm", f"at {score.distance_m:.2f} m"),
        ("joint angles, mean", f"{score.angles_mean_deg:.2f} deg", "fixed joints left out"),
        (
            "hand orientation",
            f"{score.orientation.rms_deg:.2f} deg",
            f"RMS; mean {score.orientation.mean_deg:.2f}, most {score.orientation.max_deg:.2f}",
        ),
        ("wrist position, RMS", f"{score.wrist.total_rms_mm:.2f} mm", ""),
        ("dropouts", f"{100 * score.coverage.missed_share:.1f} %", coverage_text(score.coverage)),
        ("limit violations", str(score.violations.count), _worst(score)),
        (
            "delay",
            "-" if score.delay_ms is None else f"{score.delay_ms:.1f} ms",
            "of the content; - where the motion does not tell",
        ),
    ]
    count = f"{score.scored} of {score.poses} poses inside the truth"
    if score.predicted:
        count += f", {score.predicted} with a predicted finger"
    return "\n\n".join(
        [
            f"{hand} hand: {count}",
            table(
                (
                    "point",
                    "bias x",
                    "bias y",
                    "bias z",
                    "RMS x",
                    "RMS y",
                    "RMS z",
                    "RMS mm",
                    "max mm",
                ),
                tips,
            ),
            table(("angle", "bias", "mean", "max deg"), angles),
            plain(lines),
        ]
    )


def objects_text(objects: dict[str, ObjectScore]) -> str:
    """One row per object."""
    rows = [
        (
            name,
            f"{one.scored}/{one.poses}",
            *(_point(one.position) if one.position else ["-"] * 8),
            _number(one.orientation.rms_deg if one.orientation else None),
            f"{100 * one.coverage.missed_share:.1f}",
            _number(one.delay_ms, 1),
        )
        for name, one in objects.items()
    ]
    header = (
        "object",
        "poses",
        "bias x",
        "bias y",
        "bias z",
        "RMS x",
        "RMS y",
        "RMS z",
        "RMS mm",
        "max mm",
        "turn deg",
        "lost %",
        "delay ms",
    )
    return table(header, rows)


def stages_text(hand: str, stages: Stages) -> str:
    """Markers and points, one row each."""
    markers = [
        (
            f"{camera} {name}",
            f"{100 * one.found_share:.1f}",
            str(one.strays),
            *(_number(v) for v in (*one.bias_px, *one.rms_px)),
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
            table(
                ("marker", "found %", "strays", "bias x", "bias y", "RMS x", "RMS y px"), markers
            ),
            f"{hand} hand, points against the truth's landmarks:",
            table(
                (
                    "point",
                    "found %",
                    "pred. %",
                    "bias x",
                    "bias y",
                    "bias z",
                    "RMS x",
                    "RMS y",
                    "RMS z",
                    "RMS mm",
                    "max mm",
                ),
                points,
            ),
        ]
    )


def coverage_text(coverage: Coverage) -> str:
    """The dropouts in words."""
    text = f"{coverage.missed} of {coverage.expected} instants, longest gap {coverage.longest_gap_ms:.0f} ms"
    return text + (f", {coverage.outside} poses outside the truth" if coverage.outside else "")


def plain(rows: Sequence[Sequence[str]]) -> str:
    """Rows without a header."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )


def _worst(score: HandScore) -> str:
    found = score.violations
    return f"worst {found.worst_deg:.2f} deg at {found.worst_joint}" if found.count else "none"


def _point(error: PointError) -> list[str]:
    return [_number(v) for v in (*error.bias_mm, *error.rms_mm, error.total_rms_mm, error.max_mm)]


def _number(value: float | None, digits: int = 2) -> str:
    # Adding 0.0 turns the -0.0 of a rounded small number into 0.0.
    return "-" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"
