"""docs/reference/topics.md, from the table of topics."""

from __future__ import annotations

from docs.generate.markdown import generated_from, table, wrapped
from rhot.topics import ROOT, TOPICS, Topic

_ABOUT = f"""A key is `{ROOT}/<rig>/` and the name below, unless the name begins with another root.
Names in braces are filled in; left out of a subscription they become the wildcard `*`. Messages are
JSON; their fields are in [messages](messages.md). Fields may be added, never renamed."""
_KINDS = """A **stream** is published, and dropped rather than late. A **query** is answered. A
**state** is published when it changes and answers who asks; some take a put. A **token** is a
Zenoh liveliness token. Recorded topics are what `rhot record` writes."""


def _row(topic: Topic) -> list[str]:
    name = topic.message.__name__ if topic.message else ""
    payload = f"[{name}](messages.md#{name.lower()})" if name else topic.media_type or "-"
    key = topic.template if topic.root == ROOT else f"{topic.root}/<rig>/{topic.template}"
    recorded = "yes" if topic.recorded else ""
    return [f"`{key}`", payload, topic.kind.value, topic.rate.value, recorded, topic.about]


def page() -> str:
    """The whole page."""
    head = ["key", "payload", "kind", "expected rate", "recorded", "what it is"]
    return "\n\n".join(
        [
            "# Topics",
            generated_from("`rhot/topics.py`"),
            wrapped(_ABOUT),
            wrapped(_KINDS),
            table(head, map(_row, TOPICS)) + "\n",
        ]
    )
