"""Messages that set a camera: what decodes, what does not."""

from __future__ import annotations

import msgspec
import pytest

from rhot import topics
from rhot.files.calibration import Colors, Exposure
from rhot.messages.camera import ExposureControl, FitRequest, Patch, PointedAt, picture_name


def test_a_colours_file_is_a_message_as_it_is(repository):
    text = (repository / "config" / "calibration" / "left.colors.json").read_bytes()
    assert msgspec.json.decode(text, type=topics.COLORS.message) == msgspec.json.decode(
        text, type=Colors
    )
    assert len(text) < topics.COLORS.max_bytes


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        (Colors, b"{}"),
        (Colors, b'{"colors":{"a":{"hsv_low":[180,0,0],"hsv_high":[0,0,0]}}}'),
        (Colors, b'{"colors":{"a":{"hsv_low":[0,0],"hsv_high":[0,0,0]}}}'),
        (Exposure, b'{"exposure_us":0,"gain":1,"red_gain":1,"blue_gain":1}'),
        (ExposureControl, b'{"mode":"x"}'),
        (ExposureControl, b'{"exposure_us":1e7}'),
        (ExposureControl, b'{"gain":-1}'),
        (PointedAt, b'{"color":"a","picture":"xyz","x_px":0,"y_px":0}'),
        (PointedAt, b'{"color":"a b","picture":"0123456789abcdef","x_px":0,"y_px":0}'),
        (PointedAt, b'{"color":"a","picture":"0123456789abcdef","x_px":1e300,"y_px":0}'),
        (
            Patch,
            b'{"color":"a","picture":"0123456789abcdef","box_px":[0,0,1,99999999999999999999]}',
        ),
        (FitRequest, b'{"pictures":["0123456789abcdef","0","0","0","0","0","0","0","0"]}'),
    ],
)
def test_what_cannot_be_does_not_decode(kind, text):
    with pytest.raises(msgspec.ValidationError):
        msgspec.json.decode(text, type=kind)


def test_pictures_are_named_by_their_bytes():
    assert picture_name(b"a") != picture_name(b"b")
    assert picture_name(b"a") == picture_name(b"a")
    msgspec.convert({"color": "a", "picture": picture_name(b"a"), "x_px": 0, "y_px": 0}, PointedAt)
