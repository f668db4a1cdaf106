"""What the simulator shows, and what has gone wrong with it: set while it runs, to be tried without
any hardware. Pure.

A covered dab of paint is skin. A bumped camera takes its pictures from where it is now, while its
calibration, which every other service reads, says where it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot.errors import ConfigError
from rhot.files.config import RigConfig
from rhot.geometry.transforms import rotation_x, rotation_y, rotation_z, transform
from rhot.messages.simulator import SimStage
from services.simulator.recorded_motion.scenes import live_scene
from services.simulator.scene.scene import Scene, load_scene


class Stage:
    """A scene, and what each camera sees of it.

    scene is as it is: its truth and its trackers. changes counts how often it was set.
    """

    def __init__(self, config: RigConfig) -> None:
        """Errors as of services/simulator/recorded_motion/scenes.py."""
        self._config = config
        self.scene: Scene = live_scene(config)
        self.wanted = SimStage()
        self.changes = 0

    def set(self, wanted: SimStage) -> None:
        """Show something else.

        Raises ConfigError that lists what is valid; nothing has changed then.
        """
        scene = self.scene
        if wanted.scene != self.wanted.scene:
            own = not wanted.scene
            scene = live_scene(self._config) if own else load_scene(self._config, wanted.scene)
        _check(wanted, scene)
        self.scene, self.wanted = scene, wanted
        self.changes += 1

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


def _check(wanted: SimStage, scene: Scene) -> None:
    """Raises ConfigError for paint or cameras that the scene does not have."""
    painted = [f"{name}.{mark}" for name, hand in scene.hands.items() for mark in hand.landmarks]
    for landmark in wanted.hidden:
        if landmark not in painted:
            raise ConfigError(f"no paint {landmark!r} to cover; valid: {', '.join(painted)}")
    for camera in wanted.turned_deg:
        if camera not in scene.cameras:
            raise ConfigError(f"no camera {camera!r} to turn; valid: {', '.join(scene.cameras)}")
