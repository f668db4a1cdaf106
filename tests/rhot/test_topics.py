import pytest

from rhot import topics
from rhot.errors import BusError


def test_keys_and_names_are_inverse():
    for topic in topics.TOPICS:
        names = {field: f"{field}-1" for field in topic.fields}
        key = topic.key("desk", **names)
        assert topic.names(key) == names
        assert topics.find(key) is topic


def test_a_field_left_out_is_a_wildcard():
    assert topics.MARKERS.key("desk") == "rhot/desk/camera/*/markers"
    assert topics.POSE.key("*", hand="left") == "rhot/*/hand/left/pose"


@pytest.mark.parametrize("name", ["", "a/b", "*", "a b", "?", "../x", "-a", "x" * 65])
def test_names_that_cannot_be_part_of_a_key(name):
    with pytest.raises(BusError, match="letters, digits"):
        topics.MARKERS.key("desk", camera=name)


def test_unknown_fields_are_refused():
    with pytest.raises(BusError, match="has no field"):
        topics.MARKERS.key("desk", hand="left")


def test_foreign_keys_belong_to_no_topic():
    assert topics.find("rhot/desk/camera/left/nonsense") is None
    assert topics.find("@/abc/router") is None


def test_docs_page_is_generated_from_the_table(repository):
    page = (repository / "docs" / "reference" / "topics.md").read_text()
    for topic in topics.TOPICS:
        assert f"{topic.template}`" in page


def test_a_subscription_to_everything_of_a_rig_shows_json_only():
    for topic in topics.TOPICS:
        published = topic.kind in (topics.Kind.STREAM, topics.Kind.STATE)
        if published and topic.root == topics.ROOT:
            assert topic.media_type == "application/json", topic.template
