"""Write docs/topics.md from the topics table: `make docs`."""

from __future__ import annotations

from pathlib import Path

from rhot.topics import ROOT, TOPICS, Topic

HEAD = f"""# Topics

Generated from `rhot/topics.py` by `make docs`. Every key starts with `{ROOT}/<rig>/`, or as given; fields of a message are described in
`rhot/messages.py`. Fields may be added, never renamed.

| key | message | kind | expected rate | recorded | what it is |
|---|---|---|---|---|---|
"""


def row(topic: Topic) -> str:
    """One line of the table."""
    message = f"{topic.message.__name__} (JSON)" if topic.message else topic.media_type or "-"
    recorded = "yes" if topic.recorded else ""
    key = topic.template if topic.root == ROOT else f"{topic.root}/<rig>/{topic.template}"
    return f"| `{key}` | {message} | {topic.kind.value} | {topic.rate.value} | {recorded} | {topic.about} |"


def main() -> None:
    """Write the page beside this file."""
    page = HEAD + "\n".join(row(topic) for topic in TOPICS) + "\n"
    (Path(__file__).parent / "topics.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
