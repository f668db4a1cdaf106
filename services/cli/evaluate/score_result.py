"""A result folder against the capture it was made from: reads both and computes the score.

Only simulated captures have a truth. Any other capture, an interrupted result, or a result of
another capture is a CaptureError that says so.
"""

from __future__ import annotations

from pathlib import Path

from rhot.errors import CaptureError
from rhot.files.calibration import load_hand, load_rig_cameras
from rhot.files.capture import Capture, read_lines
from rhot.files.config import RigConfig, load_rig
from rhot.hand import HANDS, HandModel, HandName
from rhot.messages import HandPoints, HandPose, MarkerFrame
from rhot.messages.objects import ObjectPose
from rhot.messages.simulator import Truth
from rhot.topics import Rate
from services.cli.evaluate.contacts.score_contacts import score_contacts
from services.cli.evaluate.score_math import score_hand
from services.cli.evaluate.score_objects import score_object
from services.cli.evaluate.score_types import ObjectScore, Score, Stages
from services.cli.evaluate.stages import landmark_truth, marker_errors, point_errors
from services.cli.evaluate.truth_track import HandTrack, hand_track, object_track
from services.cli.offline.results import check_result


def score_result(capture: Capture, result: Path, *, stages: bool = False) -> Score:
    """Score one result.

    Raises CaptureError if the capture has no truth, the result no poses, or if they do not belong
    together.
    """
    _check_capture(capture)
    check_result(result, "poses", "objects", *(("markers", "points") if stages else ()))
    config = load_rig(capture.rig_toml)
    truth = list(read_lines(capture.truth, Truth))
    poses = list(read_lines(result / "poses.jsonl", HandPose))
    period_ns = 1e9 / (config.rate_hz(Rate.HAND) or 30.0)
    models = _models(config, truth)
    tracks = {hand: hand_track(truth, hand) for hand in models}
    poses_of = {hand: [pose for pose in poses if pose.hand == hand] for hand in models}
    if models and not any(poses_of.values()):
        raise CaptureError(
            f"{result}: has no pose of the {' or '.join(models)} hand; "
            f"see {result / 'summary.json'} for the reason"
        )
    hands = {
        str(hand): score_hand(own, tracks[hand], models[hand], period_ns)
        for hand, own in poses_of.items()
        if own
    }
    scored_stages = {
        str(hand): _stages(config, hand, models[hand], tracks[hand], result)
        for hand in (models if stages else ())
    }
    return Score(
        hands=hands,
        objects=_objects(config, truth, result, period_ns),
        stages=scored_stages,
        contacts=score_contacts(truth, result),
        notes=_notes(poses_of),
    )


def _check_capture(capture: Capture) -> None:
    folder = capture.folder
    if not folder.is_dir():
        raise CaptureError(
            f"{folder}: no such folder; make a capture with `rhot simulate fist --out {folder}`"
        )
    if not capture.truth.is_file():
        raise CaptureError(
            f"{folder}: has no truth.jsonl; only captures of `rhot simulate` can be scored"
        )


def _models(config: RigConfig, truth: list[Truth]) -> dict[HandName, HandModel]:
    """The hands that rig.toml configures and the truth knows."""
    known = {hand for line in truth for hand in line.hands}
    return {
        hand: load_hand(config.calibration_dir, hand, config.hand[hand].scale)
        for hand in HANDS
        if hand in config.hand and hand in known
    }


def _notes(poses_of: dict[HandName, list[HandPose]]) -> list[str]:
    if not poses_of:
        return ["truth.jsonl knows no hand that rig.toml configures; no hand was scored"]
    return [
        f"no pose of the {hand} hand, which truth.jsonl knows"
        for hand, own in poses_of.items()
        if not own
    ]


def _objects(
    config: RigConfig, truth: list[Truth], result: Path, period_ns: float
) -> dict[str, ObjectScore]:
    poses = list(read_lines(result / "objects.jsonl", ObjectPose))
    known = {name for line in truth for name in line.objects}
    return {
        name: score_object(
            [pose for pose in poses if pose.object == name], object_track(truth, name), period_ns
        )
        for name in sorted(known & {table.name for table in config.object})
    }


def _stages(
    config: RigConfig, hand: HandName, model: HandModel, track: HandTrack, result: Path
) -> Stages:
    names = config.hand[hand].marker_names
    landmark_of = {name: landmark for landmark, name in names.items()}
    points = landmark_truth(model, track, landmark_of.values())
    cameras = load_rig_cameras(config)
    frames = read_lines(result / "markers.jsonl", MarkerFrame)
    lines = (line for line in read_lines(result / "points.jsonl", HandPoints) if line.hand == hand)
    return Stages(
        markers=marker_errors(frames, cameras, landmark_of, track.stamps_ns, points),
        points=point_errors(lines, track.stamps_ns, points),
    )
