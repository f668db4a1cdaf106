"""A result folder against the capture it was made from: reads both, and asks scoring.py and
stages.py for the figures.

Only simulated captures have a truth; any other one, an interrupted result, or a result of another
capture is a CaptureError that says so.
"""

from __future__ import annotations

from pathlib import Path

from rhot.errors import CaptureError
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.capture import Capture, read_lines
from rhot.files.config import RigConfig, load_rig
from rhot.hand import HANDS, HandModel, HandName
from rhot.messages import HandPoints, HandPose, MarkerFrame, ObjectPose
from rhot.simulator_messages import Truth
from rhot.topics import Rate
from services.cli.evaluate.score_math import score_hand, score_object
from services.cli.evaluate.score_types import Score, Stages
from services.cli.evaluate.stages import landmark_truth, marker_errors, point_errors
from services.cli.evaluate.truth_track import HandTrack, hand_track, object_track
from services.cli.offline.results import check_result


def score_result(capture: Capture, result: Path, *, stages: bool = False) -> Score:
    """Score one result.

    Raises CaptureError if the capture has no truth, the result no poses, or if they do not belong
    together.
    """
    if not capture.folder.is_dir():
        raise CaptureError(
            f"{capture.folder}: no such folder; make a capture with `rhot simulate fist --out {capture.folder}`"
        )
    if not capture.truth.is_file():
        raise CaptureError(
            f"{capture.folder}: has no truth.jsonl; only captures of `rhot simulate` can be scored"
        )
    check_result(result, "poses", "objects", *(("markers", "points") if stages else ()))
    config = load_rig(capture.rig_toml)
    truth = list(read_lines(capture.truth, Truth))
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    period_ns = 1e9 / (config.rate_hz(Rate.HAND) or 30.0)
    models = _models(config, truth)
    notes = (
        [] if models else ["truth.jsonl knows no hand that rig.toml configures; no hand was scored"]
    )
    notes += [
        f"no pose of the {hand} hand, which truth.jsonl knows"
        for hand in models
        if not any(p.hand == hand for p in poses)
    ]
    tracks = {hand: hand_track(truth, hand) for hand in models}
    seen = [hand for hand in models if any(pose.hand == hand for pose in poses)]
    if models and not seen:
        raise CaptureError(
            f"{result}: has no pose of the {' or '.join(models)} hand; see {result / 'summary.json'} for the reason"
        )
    hands = {
        hand: score_hand(
            [p for p in poses if p.hand == hand], tracks[hand], models[hand], period_ns
        )
        for hand in seen
    }
    objects = list(read_lines(result / "objects.jsonl", ObjectPose))
    names = sorted(
        {name for line in truth for name in line.objects} & {table.name for table in config.object}
    )
    return Score(
        hands={str(hand): one for hand, one in hands.items()},
        objects={
            name: score_object(
                [o for o in objects if o.object == name], object_track(truth, name), period_ns
            )
            for name in names
        },
        stages={hand: _stages(config, hand, models[hand], tracks[hand], result) for hand in models}
        if stages
        else {},
        notes=notes,
    )


def _models(config: RigConfig, truth: list[Truth]) -> dict[HandName, HandModel]:
    """The hands that rig.toml configures and the truth knows."""
    known = {hand for line in truth for hand in line.hands}
    return {
        hand: load_hand(config.calibration_dir, hand, config.hand[hand].scale)
        for hand in HANDS
        if hand in config.hand and hand in known
    }


def _stages(
    config: RigConfig, hand: HandName, model: HandModel, track: HandTrack, result: Path
) -> Stages:
    landmark_of = {color: landmark for landmark, color in config.hand[hand].markers.items()}
    points = landmark_truth(model, track, landmark_of.values())
    cameras = load_rig_cameras(config)
    frames = read_lines(result / "markers.jsonl", MarkerFrame)
    lines = (line for line in read_lines(result / "points.jsonl", HandPoints) if line.hand == hand)
    return Stages(
        markers=marker_errors(frames, cameras, landmark_of, track.stamps_ns, points),
        points=point_errors(lines, track.stamps_ns, points),
    )
