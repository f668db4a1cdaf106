import pytest

from rhot.errors import ConfigError
from rhot.files.config import RigConfig, load_rig
from rhot.files.rig_tables import HandTable, ObjectTable
from rhot.topics import Rate


@pytest.fixture
def rig(tmp_path):
    def write(text):
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return path

    return write


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            '[[camera]]\nname = "l"\nsorce = "x"',
            (
                r"\[camera\[0\]\]: unknown key `sorce`, did you mean `source`\?"
                ".*Valid keys: name, source"
            ),
        ),
        ("[rig]\nname = 3", "`rig.name`: expected `str`, got `int`"),
        ("[fusion.one_euro]\nbta = 1", "did you mean `beta`"),
        ('[hand.right.markers]\nindx_tip = "blue"', "did you mean 'index_tip'"),
        ('[hand.rigt.markers]\nwrist = "b"', "valid: left, right"),
        ('[solver]\nmethod = "foo"', "valid: analytic, dls"),
        ("bla = 1", "top level: unknown key `bla`"),
        ('[[camera]]\nname = "a b"', "camera\\[0\\].name"),
        ('[[camera]]\nname = "a"\nfps = -1', "expected `float` > 0.0"),
        ('[[camera]]\nname = "a"\n[[camera]]\nname = "a"', "'a' is used twice"),
        ('[hand.right.markers]\nwrist = "blue"\nindex_tip = "blue"', "'blue' is used twice"),
        (
            '[hand.right.markers]\nwrist = "blue"\n[hand.left.markers]\nwrist = "blue"',
            "'blue' is used twice",
        ),
        ("[hand.right]\nmarkers = {}", "is empty"),
        ("[rig", "not valid TOML"),
        ('folder = "x"', "unknown key `folder`"),
        ("[viewer]\nhost = '0.0.0.0'", "needs a token"),
    ],
)
def test_errors_say_where_what_and_what_would_be_right(rig, text, says):
    path = rig(text)
    with pytest.raises(ConfigError, match=says) as error:
        load_rig(path)
    assert str(error.value).startswith(str(path))


def test_a_missing_file_names_the_examples(tmp_path):
    with pytest.raises(ConfigError, match=r"rig\.example\.toml"):
        load_rig(tmp_path / "none.toml")


def test_an_empty_file_is_all_defaults(rig):
    config = load_rig(rig(""))
    assert config.fusion.method == "kalman"
    assert config.calibration_dir.name == "calibration"


def test_the_shipped_files_load(repository):
    for name in ("sim.toml", "rig.example.toml"):
        config = load_rig(repository / "config" / name)
        assert {camera.name for camera in config.camera} == {"left", "right"}


def test_expected_rates(rig):
    config = load_rig(
        rig('[[camera]]\nname="a"\nfps=30\n[[camera]]\nname="b"\nfps=60\n[objects]\nrate_hz=90')
    )
    assert config.rate_hz(Rate.CAMERA, "a") == 30.0
    assert config.rate_hz(Rate.HAND) == 60.0
    assert config.rate_hz(Rate.OBJECT) == 90.0
    assert config.rate_hz(Rate.DEMAND) == 0.0


def test_hands_and_trackers_wear_colors():
    config = RigConfig(
        hand={"right": HandTable(markers={"index_tip": "blue"})},
        object=[ObjectTable(name="cup", serial="LHR-1", marker="orange")],
    )
    assert config.wearer("blue") == "the right hand's index tip"
    assert config.wearer("orange") == "the cup's tracker"
    assert config.wearer("green") == ""
    assert (config.colors, config.hand_colors) == (["blue", "orange"], ["blue"])


def test_joints_of_one_colour_are_markers_with_names_of_their_own(rig):
    config = load_rig(
        rig(
            '[hand.right]\njoints = "red"\nfingers = ["thumb", "index"]\n'
            '[hand.right.markers]\nwrist = "blue"\nindex_tip = "lime"\n'
        )
    )
    names = config.hand["right"].marker_names
    assert len(names) == 9
    assert (names["wrist"], names["index_tip"]) == ("blue", "lime")
    assert names["thumb_distal"] == "red.thumb_distal"
    assert config.colors == ["blue", "lime", "red"]
    assert config.dots == {"red": {k: v for k, v in names.items() if v.startswith("red.")}}
    assert sorted(config.markers_of(["blue", "red"])) == sorted(
        ["blue", *config.dots["red"].values()]
    )
    assert config.color_of("red.thumb_tip") == "red"
    assert config.wearer("red.thumb_tip") == "the right hand's thumb tip"
    assert "7 joints" in config.wearer("red")


def test_joints_without_fingers_are_all_that_there_may_be(rig):
    config = load_rig(rig('[hand.left]\njoints = "red"'))
    assert len(config.dots["red"]) == 20
    shared = load_rig(rig('[hand.left.markers]\nindex_distal = "red"\nindex_tip = "red"'))
    assert set(shared.dots["red"]) == {"index_distal", "index_tip"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('[hand.right]\nfingers = ["index"]', "has fingers, but no joints"),
        ('[hand.right]\njoints = "red"\nfingers = ["index", "index"]', "'index' twice"),
        ('[hand.right]\njoints = "red"\nfingers = ["pinky"]', "valid: index"),
        ('[hand.right]\njoints = "red"\n[hand.left]\njoints = "red"', "'red' is used twice"),
        (
            '[hand.right]\njoints = "red"\n[[object]]\nname = "cup"\nserial = "a"\nmarker = "red"',
            "'red' is used twice",
        ),
    ],
)
def test_wrong_joints_are_told(rig, text, says):
    with pytest.raises(ConfigError, match=says):
        load_rig(rig(text))
