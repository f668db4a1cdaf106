"""Keys and names of the bus as words; what somebody else sends stays harmless."""

from __future__ import annotations

from rhot.topics import TOPICS, Kind
from services.viewer.panel.words import plain, sentence, stream_words


def test_every_stream_has_words():
    for topic in TOPICS:
        if topic.kind is not Kind.STREAM:
            continue
        one = stream_words(topic.key("desk", **dict.fromkeys(topic.fields, "left")))
        every = stream_words(topic.key("desk"))
        for words in (one, every):
            assert "/" not in words
            assert "{" not in words
            assert "*" not in words


def test_keys_in_sentences():
    told = "rhot/sim/object/*/pose: 27.0 a second received instead of 120.0"
    assert plain(told) == "poses of the objects: 27.0 a second received instead of 120.0"
    assert plain("see rhot/desk/hand/left/pose.") == "see pose of the left hand."
    for other in ("run rhot up rig.toml", "calibration/rig.json", "rhot/desk/nothing/of/ours"):
        assert plain(other) == other


def test_commands_are_set_apart_and_nothing_else_is_html():
    assert sentence("run `rhot check` <b>now</b>") == (
        "run <code>rhot check</code> &lt;b&gt;now&lt;/b&gt;"
    )
    assert len(sentence("rhot/" * 10_000)) <= 300
