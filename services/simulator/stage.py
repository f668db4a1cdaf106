"""What the simulator shows, and what has gone wrong with it: set while it runs, to be tried without
any hardware. Pure.

A covered dab of paint is skin. A bumped camera takes its pictures from where it is now, while its
calibration, which every other service reads, says where it was. Who shows a board has no hand free,
and has put the objects away: behind the cameras.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import msgspec
import numpy as np

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.geometry.transforms import Array, rotation_x, rotation_y, rotation_z, transform
from rhot.messages.simulator import SimBoard, SimStage
from services.simulator.board.carried import CarriedBoard
from services.simulator.board.places import place
from services.simulator.hands.gestures import Gesture, Motion
from services.simulator.recorded_motion.scenes import live_scene
from services.simulator.scene.scene import Scene, load_scene

# Objects that are put away, in the first camera's frame.
_PUT_AWAY = transform(np.eye(3), (0.0, 0.0, -1.0))


class Stage:
    """A scene, and what each camera sees of it.

    scene is as it is: its truth and its trackers. changes counts how often it was set.
    """

    def __init__(self, config: RigConfig, kept: RigConfig | None = None) -> None:
        """kept has the calibration of scenes that are set later, where config's may change.

        Errors as of services/simulator/recorded_motion/scenes.py.
        """
        self._config = kept or config
        self._scene: Scene = live_scene(config)
        self.scene: Scene = self._scene
        self.wanted = SimStage()
        self.changes = 0
        # What is shown once a lease is over, and when that is.
        self._lasting = SimStage()
        self._lease_ends_s = math.inf

    def set(self, wanted: SimStage, now_s: Callable[[], float] = lambda: 0.0) -> None:
        """Show something else, or the same for longer; now_s tells the scene's time.

        Raises ConfigError that lists what is valid; nothing has changed then.
        """
        if not wanted.renews:
            self._show(wanted, now_s)
        elif not wanted.shows_as(self.wanted):
            return
        if wanted.lease_s is None:
            self._lasting, self._lease_ends_s = self.wanted, math.inf
        else:
            self._lease_ends_s = now_s() + wanted.lease_s
            self.end_lease(now_s)

    def end_lease(self, now_s: Callable[[], float]) -> None:
        """Show again what was there before, once nobody has asked for longer."""
        if now_s() >= self._lease_ends_s:
            self._show(self._lasting, now_s)
            self._lease_ends_s = math.inf

    def _show(self, wanted: SimStage, now_s: Callable[[], float]) -> None:
        scene, before = self._scene, self.wanted
        if (wanted.scene, wanted.speed) != (before.scene, before.speed):
            scene = self._loaded(wanted)
        _check(wanted, scene)
        if wanted.board and self.scene.board and wanted.shows_as(before):
            self.scene.board.carry(self._place(wanted.board), now_s())
            self.wanted = wanted
            return
        self._scene, self.wanted = scene, wanted
        if wanted.begins_in_s is not None:
            scene = _begun(scene, now_s() + wanted.begins_in_s)
        if wanted.board:
            scene = _put_away(scene)
            board = CarriedBoard(wanted.board.kind, self._place(wanted.board))
            scene = replace(scene, hands={}, board=board)
        self.scene = scene
        self.changes += 1

    def _loaded(self, wanted: SimStage) -> Scene:
        settings = self._config.simulator
        speed = settings.speed * wanted.speed
        if wanted.scene:
            return load_scene(self._config, wanted.scene, speed=speed)
        simulator = msgspec.structs.replace(settings, speed=speed)
        return live_scene(msgspec.structs.replace(self._config, simulator=simulator))

    def _place(self, board: SimBoard) -> Array:
        """T_rig_from_board (4, 4) where it shall be."""
        cameras, seed = self._scene.cameras, self._scene.seed
        meant = [cameras[board.camera]] if board.camera else list(cameras.values())
        return place(meant, board.place, seed)

    def seen_by(self, camera: str) -> Scene:
        """The scene as that camera sees it: without hidden paint, and from where it is now."""
        scene, wanted = self.scene, self.wanted
        hands = {
            name: replace(
                hand,
                landmarks={
                    landmark: color
                    for landmark, color in hand.landmarks.items()
                    if f"{name}.{landmark}" not in wanted.hidden
                },
            )
            for name, hand in scene.hands.items()
        }
        cameras = dict(scene.cameras)
        if camera in wanted.turned_deg:
            x, y, z = np.deg2rad(wanted.turned_deg[camera])
            turn = transform(rotation_z(z) @ rotation_y(y) @ rotation_x(x), np.zeros(3))
            was = cameras[camera]
            cameras[camera] = replace(was, T_rig_from_camera=was.T_rig_from_camera @ turn)
        return replace(scene, hands=hands, cameras=cameras)


def _begun(scene: Scene, begins_s: float) -> Scene:
    """The scene with hands that begin their motion at that scene time, and wait for it."""

    def waiting(motion: Motion, begins: float) -> Motion:
        def at(t: float) -> Gesture:
            return motion(max(0.0, t - begins))

        return at

    hands = {
        name: replace(hand, motion=waiting(hand.motion, hand.speed * begins_s))
        for name, hand in scene.hands.items()
    }
    return replace(scene, hands=hands)


def _put_away(scene: Scene) -> Scene:
    first = next(iter(scene.cameras.values()))
    away = first.T_rig_from_camera @ _PUT_AWAY
    objects = [
        replace(item, T_rig_from_rest=away, holder=None, sweep=None) for item in scene.objects
    ]
    return replace(scene, objects=objects)


def _check(wanted: SimStage, scene: Scene) -> None:
    """Raises ConfigError for paint or cameras that the scene does not have."""
    painted = [f"{name}.{mark}" for name, hand in scene.hands.items() for mark in hand.landmarks]
    for landmark in wanted.hidden:
        if landmark not in painted:
            raise ConfigError(f"no paint {landmark!r} to cover; valid: {', '.join(painted)}")
    if wanted.board and wanted.board.camera not in ("", *scene.cameras):
        raise ConfigError(
            f"no camera {wanted.board.camera!r} to show a board; valid: {', '.join(scene.cameras)}"
        )
    for camera in wanted.turned_deg:
        if camera not in scene.cameras:
            raise ConfigError(f"no camera {camera!r} to turn; valid: {', '.join(scene.cameras)}")
