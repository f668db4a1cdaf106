"""The panel's texts: what is missing is said, and nothing from the network reaches the browser as
code.
"""

from __future__ import annotations

from collections.abc import Callable
from html.parser import HTMLParser

import msgspec
import pytest

from rhot.files.config import RigConfig
from rhot.messages import FingerAngles, HandPoints, HandPose
from rhot.messages.health import Health
from rhot.messages.objects import ObjectPose
from services.viewer.live.model import ViewModel
from services.viewer.panel import texts

STAMP_NS = 1_700_000_000_000_000_000
EVIL = '<script>alert("x")</script><img src=x onerror=alert(1)>{alert(2)}&amp;\n\x00'


class Tags(HTMLParser):
    """Collects tags and attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}


def assert_harmless(text: str) -> None:
    found = Tags(text)
    assert found.tags <= {"div", "table", "tr", "td", "th", "b", "br", "span", "code"}
    assert found.attributes <= {"style", "colspan"}


def test_waiting_is_said_with_what_to_look_at(
    config: RigConfig, make_health: Callable[..., Health]
) -> None:
    model = ViewModel()
    said = texts.status(config, model.view(0.0), ["camera left is not drawn"])
    assert "right hand: waiting for a camera's tracker: none is heard" in said
    assert "waiting for the object cup" in said
    assert "camera left is not drawn" in said
    for service, instance, next_missing in (
        ("pi_tracker", "left", "waiting for camera right: its tracker is not heard"),
        ("pi_tracker", "right", "waiting for fusion"),
        ("fusion", "main", "waiting for the solver"),
        ("solver", "main", "hold it into the view of two cameras"),
    ):
        model.health(make_health(service, instance=instance), 0.0)
        assert next_missing in texts.status(config, model.view(0.0), [])
    for service, waited_for in (("fusion", "what cameras see"), ("simulator", "the simulator")):
        model.health(make_health(service, state="starting"), 0.0)
        assert f"{waited_for}: it is starting ..." in texts.status(config, model.view(0.0), [])
        model.health(make_health(service), 0.0)


def test_the_legend_has_each_colour_that_means_something() -> None:
    said = texts.legend()
    for words in ("measured", "solved", "predicted", "touches", "can bend no further"):
        assert words in said
    assert_harmless(said)


def test_what_is_there_is_said(
    config: RigConfig,
    make_pose: Callable[..., HandPose],
    make_points: Callable[..., HandPoints],
    make_object: Callable[..., ObjectPose],
) -> None:
    model = ViewModel()
    model.points(make_points("wrist"), 0.0)
    assert "its markers are seen; waiting for the solver" in texts.status(
        config, model.view(0.0), []
    )
    model.pose(make_pose(), 0.0, STAMP_NS + 31_400_000)
    model.object(make_object(registered=False), 0.0)
    said = texts.status(config, model.view(0.0), [])
    assert "right hand: tracked, 31 ms after the light" in said
    pose = make_pose()
    joints = [msgspec.structs.replace(joint, source="predicted") for joint in pose.joints]
    model.pose(msgspec.structs.replace(pose, joints=joints), 0.0, STAMP_NS)
    unseen = texts.status(config, model.view(0.0), [])
    assert "right hand: not seen now; shown where it is expected" in unseen
    assert "object cup: not registered" in said
    model.object(make_object(tracking="out_of_range"), 0.0)
    assert "object cup: out of the lighthouses" in texts.status(config, model.view(0.0), [])


def test_a_rig_without_hands() -> None:
    assert "no hand is configured" in texts.status(RigConfig(), ViewModel().view(0.0), [])


def test_angles_are_degrees_of_every_finger(make_pose: Callable[..., HandPose]) -> None:
    said = texts.angles(make_pose())
    assert_harmless(said)
    assert said.count("57&deg;") == 4  # pip 1 rad; the thumb has none
    assert said.count("29&deg;") == 5
    assert "mm" not in said
    assert "off by" not in said


def test_angles_that_are_absurd_or_not_solved(make_pose: Callable[..., HandPose]) -> None:
    pose = make_pose()
    angles = FingerAngles(abduction=1e300, mcp=-1e300, pip=0.0, dip=0.0)
    finger = msgspec.structs.replace(
        pose.fingers[1], angles_rad=angles, residual_m=1e300, status="not_converged"
    )
    said = texts.angles(
        msgspec.structs.replace(pose, fingers=[pose.fingers[0], finger, *pose.fingers[2:]])
    )
    assert "index (not converged)" in said
    assert "401&deg;" in said
    assert "999.0 mm" in said
    assert "off by" in said


def test_next_to_nothing_is_nothing(make_pose: Callable[..., HandPose]) -> None:
    pose = make_pose()
    finger = msgspec.structs.replace(
        pose.fingers[1], angles_rad=FingerAngles(abduction=-1e-3, mcp=-0.0, pip=1e-3, dip=0.0)
    )
    said = texts.angles(
        msgspec.structs.replace(pose, fingers=[pose.fingers[0], finger, *pose.fingers[2:]])
    )
    assert "-0&deg;" not in said
    assert said.count(">0&deg;") >= 4


def test_rates_against_expectation(make_health: Callable[..., Health]) -> None:
    assert "waiting for the services' health" in texts.rates([])
    good = texts.rates([make_health()])
    assert "points of the right hand" in good
    assert "rhot/" not in good
    assert "29.9" in good
    assert "1.2" in good
    assert "#c0392b" not in good
    bad = texts.rates(
        [
            make_health(
                last_error="camera gone",
                stream={"ok": False, "rate_hz": 3.0, "dropped": 4, "rejected": 3},
            )
        ]
    )
    assert '<span style="color:#c0392b">3.0</span>' in bad
    assert ">7<" in bad
    assert "camera gone" in bad
    assert_harmless(bad)


def test_rates_are_bounded(make_health: Callable[..., Health]) -> None:
    said = texts.rates([make_health(f"s{i}") for i in range(64)])
    assert "and 69 more" in said
    huge = make_health(
        cpu_percent=1e300,
        stream={
            "rate_hz": 1e300,
            "expected_hz": 1e300,
            "latency_p50_ms": 1e300,
            "dropped": 2**63 - 1,
        },
    )
    assert len(texts.rates([huge])) < 2000


@pytest.mark.parametrize("evil", [EVIL, "x" * 100_000, "\u202e\u2028\ufeff", "</td></table>"])
def test_nothing_from_the_network_is_code(make_health: Callable[..., Health], evil: str) -> None:
    said = texts.rates(
        [
            make_health(last_error=evil, stream={"key": evil}),
            make_health("x", stream={"key": f"rhot/desk/*/{evil}"}),
        ]
    )
    assert_harmless(said)
    assert len(said) < 5000
    assert "\u202e" not in said


def test_previews() -> None:
    assert "waiting for the picture of left" in texts.preview("left", None)
    assert 'src="data:image/jpeg;base64,AAAA"' in texts.preview("left", "AAAA")


def test_other_rigs_are_links_and_no_name_is_code() -> None:
    said = texts.other_rigs("desk", [("bench", "http://127.0.0.1:1/?token=a&b")])
    assert "rig <b>desk</b>" in said
    assert '<a href="http://127.0.0.1:1/?token=a&amp;b"' in said
    assert "<script>" not in texts.other_rigs("<script>", [("<script>", '"><script>')])


def test_of_a_replay_nothing_is_waited_for(config: RigConfig) -> None:
    nothing = ViewModel().view(0.0)
    assert "waiting for" in texts.status(config, nothing, [])
    assert "move the time line" in texts.status(config, nothing, [], replayed=True)
    assert "waiting for" not in texts.status(config, nothing, [], replayed=True)
