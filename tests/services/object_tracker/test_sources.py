"""The names of pose sources."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from rhot.errors import SourceError
from rhot.files.config import RigConfig
from rhot.files.rig_tables import Objects
from rhot.messages.objects import OpenVrPose
from services.object_tracker.sources import open_source
from services.object_tracker.sources.libsurvive import LibSurvive, Playback
from services.object_tracker.sources.replay import Replay

MakePose = Callable[..., OpenVrPose]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("steamvr", type(None)),
        ("libsurvive", LibSurvive),
        ("replay:x.jsonl", Replay),
        ("playback:x.rec.gz", Playback),
        ("simulator", type(None)),
        ("network", type(None)),
    ],
)
def test_names_of_sources(name: str, kind: type) -> None:
    assert isinstance(open_source(RigConfig(objects=Objects(source=name))), kind)


@pytest.mark.parametrize("name", ["stemvr", "replay", "replay:", "playback", "steamvr:1", ""])
def test_unknown_names_list_the_valid_ones(name: str) -> None:
    with pytest.raises(SourceError, match=r"valid: steamvr, libsurvive, replay:FILE"):
        open_source(RigConfig(objects=Objects(source=name)))
