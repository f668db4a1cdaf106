"""The contacts of a result folder, scored object by object, and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rhot.files.capture import read_lines
from rhot.messages.objects import ObjectContacts
from rhot.messages.simulator import Truth
from services.cli.evaluate.contacts.contact_score import ContactScore, contact_score
from services.cli.evaluate.text_table import table


def score_contacts(truth: Sequence[Truth], result: Path) -> dict[str, ContactScore]:
    """The scores of all objects whose distances the truth tells.

    Empty for a result without contacts.jsonl, as rhot 0.1 wrote them.
    """
    path = result / "contacts.jsonl"
    if not path.is_file():
        return {}
    messages = list(read_lines(path, ObjectContacts))
    names = sorted({name for line in truth for name in line.objects})
    scores = {name: contact_score(truth, messages, name) for name in names}
    return {name: score for name, score in scores.items() if score is not None}


def contacts_text(contacts: dict[str, ContactScore]) -> str:
    """One row per object for its touches, one for its grasps."""
    rows = []
    for name, score in contacts.items():
        touches, grasps = score.touches, score.grasps
        within = f"{100 * touches.within_share:.0f}"
        edges = (touches.begin_ms, touches.end_ms, touches.begin_mm, touches.end_mm)
        rows.append(
            (
                f"{name} touches",
                f"{touches.found}/{touches.true}",
                str(touches.false),
                within,
                *(_pair(pair) for pair in edges),
            )
        )
        times = (_pair(grasps.begin_ms), _pair(grasps.end_ms), "-", "-")
        rows.append(
            (f"{name} grasps", f"{grasps.right}/{grasps.true}", str(grasps.false), "-", *times)
        )
    columns = ("begin ms", "end ms", "begin mm", "end mm")
    return table(("contacts", "found", "false", "within %", *columns), rows)


def _pair(errors: tuple[float, float]) -> str:
    """Median and 95th percentile."""
    return f"{errors[0]:.1f}/{errors[1]:.1f}"
