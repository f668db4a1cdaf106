"""The commented rig.toml of a new rig; the comments are those of rhot/files/rig_tables.py. Pure."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

from rhot.files import rig_tables
from rhot.files.rig_comments import comments_of
from rhot.files.toml_text import toml_key, toml_value
from services.cli.init.choices import CameraChoice, Choices

_COLUMNS = 100
LOCAL = "tcp/127.0.0.1:7447"
# For other hosts: encrypted, and only with a certificate of this rig (`rhot pki`).
_SECURED_PORT = 7448
_ABOUT = """rig.toml, the one file of a rig that people write: the same one for every machine of it.
Tools never change it; what they measure is in calibration/. A key that is not here has its default;
docs/reference/rig-toml.md lists them all. `rhot check rig.toml` says what is wrong or missing."""


# What an object's table may say beside its tracker, as lines to be taken in.
_OBJECT_EXTRAS = """\
# A dab of paint on the tracker, for `rhot calibrate objects`, and the object's shape:
# marker = "orange"
# shape = "cylinder"
# size_m = [0.08, 0.10]"""


def rig_text(choices: Choices) -> str:
    """The whole file."""
    parts = [_comment(_ABOUT), _table("rig", rig_tables.Rig, {"name": choices.name}), _bus(choices)]
    parts += [
        _camera(choices, camera, commented=index == 0)
        for index, camera in enumerate(choices.cameras)
    ]
    markers_comment = comments_of(rig_tables.HandTable)["markers"]
    for index, (hand, markers) in enumerate(choices.markers.items()):
        about = "" if index else _comment(markers_comment) + "\n"
        parts.append(f"{about}[hand.{hand}.markers]\n{_body(markers)}")
    if choices.objects:
        parts.append(_table("objects", rig_tables.Objects, {"source": "steamvr"}))
    for index, (name, serial) in enumerate(choices.objects.items()):
        keys = {"name": name, "serial": serial}
        table = _table("object", rig_tables.ObjectTable, keys, many=True, commented=index == 0)
        parts.append(table if index else f"{table}\n{_OBJECT_EXTRAS}")
    parts.append(_table("viewer", rig_tables.Viewer, {"port": 8080}))
    recorder = {"folder": "recordings", "autostart": False}
    parts.append(_table("recorder", rig_tables.Recorder, recorder))
    return "\n\n".join(parts) + "\n"


def _bus(choices: Choices) -> str:
    if not choices.hosts:
        return _table("bus", rig_tables.Bus, {"connect": [LOCAL], "listen": [LOCAL]})
    master = choices.master.strip("[]")
    host = f"[{master}]" if ":" in master else master
    keys = {
        "connect": [LOCAL, f"tls/{host}:{_SECURED_PORT}"],
        "listen": [LOCAL, f"tls/0.0.0.0:{_SECURED_PORT}"],
        "certificates": "pki",
    }
    return _table("bus", rig_tables.Bus, keys)


def _camera(choices: Choices, camera: CameraChoice, *, commented: bool) -> str:
    keys = {
        "name": camera.name,
        "source": camera.source,
        "fps": choices.fps,
        "size_px": list(choices.size_px),
    }
    if camera.host:
        keys["host"] = camera.host
    return _table("camera", rig_tables.CameraTable, keys, many=True, commented=commented)


def _table(
    name: str,
    table: type[rig_tables.Table],
    keys: Mapping[str, Any],
    *,
    many: bool = False,
    commented: bool = True,
) -> str:
    """A table with what rig_tables.py says of its keys, or without where that stands above."""
    comments = comments_of(table) if commented else {}
    header = f"[[{name}]]" if many else f"[{name}]"
    return f"{header}\n{_body(keys, comments)}"


def _body(keys: Mapping[str, Any], comments: Mapping[str, str] = {}) -> str:
    lines = []
    for key, value in keys.items():
        if key in comments:
            lines.append(_comment(comments[key]))
        whole = int(value) if isinstance(value, float) and value.is_integer() else value
        lines.append(f"{toml_key(key)} = {toml_value(whole)}")
    return "\n".join(lines)


def _comment(text: str) -> str:
    return "\n".join(f"# {line}" for line in textwrap.wrap(text, _COLUMNS - 2))
