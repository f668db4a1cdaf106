import msgspec
import pytest

from rhot.messages import FingerAngles, Marker, MarkerFrame
from rhot.messages.objects import OpenVrDevice

FRAME = MarkerFrame(
    camera="left",
    seq=3,
    stamp_ns=1_700_000_000_000_000_000,
    row_time_ns=33_700.0,
    clock_offset_ns=-12,
    clock_sigma_ns=50_000,
    size_px=(640, 480),
    markers=[Marker(color="blue", x_px=1.5, y_px=2.25, area_px=64.0, sigma_px=0.05, quality=1.0)],
)


def test_round_trip():
    assert msgspec.json.decode(msgspec.json.encode(FRAME), type=MarkerFrame) == FRAME


def test_a_newer_sender_may_say_more():
    text = msgspec.json.encode(FRAME)[:-1] + b',"colour_of_the_sky":"grey"}'
    assert msgspec.json.decode(text, type=MarkerFrame) == FRAME


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("camera", "a/b"),
        ("camera", "*"),
        ("camera", ""),
        ("seq", -1),
        ("seq", "3"),
        ("stamp_ns", 2**63),
        ("row_time_ns", None),
        ("row_time_ns", -1.0),
        ("size_px", [640]),
        ("size_px", [0, 480]),
        ("markers", [{"color": "blue"}]),
        (
            "markers",
            [{"color": "blue", "x_px": None, "y_px": 0, "area_px": 0, "sigma_px": 0, "quality": 0}],
        ),
        (
            "markers",
            [{"color": "blue", "x_px": 1, "y_px": 0, "area_px": 0, "sigma_px": 0, "quality": 7}],
        ),
    ],
)
def test_wrong_values_do_not_decode(field, value):
    values = msgspec.to_builtins(FRAME) | {field: value}
    with pytest.raises(msgspec.ValidationError):
        msgspec.json.decode(msgspec.json.encode(values), type=MarkerFrame)


def test_numbers_beyond_double_precision_do_not_decode():
    with pytest.raises(msgspec.DecodeError):
        msgspec.json.decode(
            msgspec.json.encode(FRAME).replace(b"33700.0", b"1e999"), type=MarkerFrame
        )


def test_the_cmc_angle_is_the_thumbs_alone():
    assert b"cmc" not in msgspec.json.encode(FingerAngles(abduction=0.0, mcp=0.1, pip=0.2, dip=0.3))
    assert b"cmc" in msgspec.json.encode(
        FingerAngles(abduction=0.0, mcp=0.1, pip=0.0, dip=0.3, cmc=0.2)
    )


def test_valves_own_field_names():
    device = OpenVrDevice(
        index=1, serial="LHR-1", device_class="tracker", model="VIVE", battery=0.5, charging=False
    )
    assert b'"class":"tracker"' in msgspec.json.encode(device)
