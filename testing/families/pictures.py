"""Cases of pictures: the simulator's, through the real tracker, with the truth and what is visible.

Each case is calibrated as a rig in its light would be: the colour ranges are fitted to its own
paint and lamps. Everything but the truth comes from disk where it was made before
(marker_cache.py).
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from rhot.files.calibration import Colors
from rhot.files.config import RigConfig, load_rig
from rhot.geometry.transforms import Array
from rhot.hand import HandModel, default_hand, landmark_point
from rhot.messages import MarkerFrame
from services.pi_tracker.image.frame import Frame
from services.pi_tracker.rig_step import step_of_rig
from services.simulator.camera.frame_source import FrameSource, TakenFrame
from services.simulator.camera.visibility import patch_visibility
from services.simulator.files.fit_colors import fit_ranges, sample_pixels
from services.simulator.render.renderer import Renderer
from services.simulator.scene.catalog import Light, SceneSpec
from services.simulator.scene.paints import SKIN, Rgb
from services.simulator.scene.scene import Scene
from testing.families.case import Case
from testing.families.marker_cache import kept
from testing.families.people import TABLES, PaintJob, Person
from testing.families.picture_motions import Moves
from testing.families.recordings import leap_hand
from testing.families.staged import staged
from testing.synthetic_points import START_NS

# Makes a context in which something is off.
Without = Callable[[], contextlib.AbstractContextManager[None]]
_RIG = Path(__file__).parents[2] / "config" / "sim.toml"
# As synchronisation leaves a camera's clock, by its own account.
CLOCK_SIGMA_NS = 500_000
# Frames of which a camera's colours are calibrated, and of which visibility is computed: the others
# have the smaller share of their neighbours.
_CALIBRATION_FRAMES = (0, 25, 50, 75, 100)
_VISIBILITY_STEP = 2


@dataclass(frozen=True)
class Recipe:
    """All that makes a case of pictures; its repr says everything.

    given_scale is the size that fusion and solver guess. jpeg, sharpen and denoise are those of
    [simulator]; wrong_range: pictures of limited range that the tracker takes for full ones.
    """

    moves: Moves = field(default_factory=Moves)
    # A Leap recording: its hand and its motion, instead of `moves` and `person`.
    recording: str = ""
    person: Person = TABLES
    paint: PaintJob = field(default_factory=PaintJob)
    light: Light = field(default_factory=Light)
    skin: Rgb = SKIN.albedo
    given_scale: float = 1.0
    distance_m: float = 0.5
    tilt_deg: float = 36.0
    exposure_s: float = 0.008
    noise: float = 5.0
    jpeg: int = 0
    sharpen: float = 0.0
    denoise: float = 0.0
    wrong_range: bool = False
    # Objects in saturated colours in the background.
    clutter: bool = False
    seconds: float = 5.0
    seed: int = 1

    def hand(self) -> HandModel:
        """The painted hand itself."""
        model = leap_hand(self.recording).model if self.recording else self.person.model()
        return self.paint.on(model)

    def config(self) -> RigConfig:
        """The rig: sim.toml's cameras, a hand of the guessed size, nothing else."""
        config = load_rig(_RIG)
        table = msgspec.structs.replace(config.hand["right"], scale=self.given_scale)
        settings = msgspec.structs.replace(
            config.simulator, jpeg=self.jpeg, sharpen=self.sharpen, denoise=self.denoise
        )
        return msgspec.structs.replace(
            config, hand={self.hand().hand: table}, object=[], simulator=settings
        )

    def scene(self, seed: int = 0) -> Scene:
        """The scene; seed: of another one in the same light, 0: of this one."""
        spec = SceneSpec(
            "still",
            "a case of testing/families",
            distance_m=self.distance_m,
            tilt_deg=self.tilt_deg,
            exposure_s=self.exposure_s,
            noise=self.noise,
            light=self.light,
            skin=self.skin,
            uneven=self.paint.uneven,
            clutter=self.clutter,
        )
        motion = self.recording or self.moves
        return staged(self.config(), spec, self.hand(), motion, seed or self.seed)


def picture_case(name: str, recipe: Recipe) -> Case:
    """A case of pictures."""
    scene, hand = recipe.scene(), recipe.hand().hand
    frames = kept("markers", recipe, lambda: detected(recipe, scene)[""], tracker=True)
    shares = kept("visible", recipe, lambda: visible_shares(recipe, scene), tracker=False)
    clocks = scene.clocks
    truth = PaintMiddles(scene, recipe.hand(), tuple(scene.hands[hand].landmarks))
    return Case(
        name=name,
        config=scene.config,
        cameras=scene.cameras,
        hands={hand: default_hand(hand, recipe.given_scale)},
        frames=frames,
        visible=np.array([shares[frame.camera][frame.seq] for frame in frames]),
        landmarks=truth.landmarks,
        truth=truth,
        seconds=recipe.seconds,
        angles=lambda at_s: scene.hand_states(at_s)[hand].angles_rad,
        clock_errors_s={name: 1e-9 * clock.residual_ns for name, clock in clocks.items()},
    )


@dataclass(eq=False)
class PaintMiddles:
    """Middles of the paint (n, L, 3) at n instants; what was asked for once is remembered."""

    scene: Scene
    model: HandModel
    landmarks: tuple[str, ...]
    _known: dict[float, Array] = field(default_factory=dict)

    def __call__(self, times_s: Array) -> Array:
        flat = np.asarray(times_s, dtype=np.float64).tolist()
        for at_s in flat:
            if at_s not in self._known:
                state = self.scene.hand_states(at_s)[self.model.hand]
                joints = self.scene.hands[self.model.hand].joints(state)
                self._known[at_s] = np.array(
                    [landmark_point(self.model, name, *joints) for name in self.landmarks]
                )
        return np.array([self._known[at_s] for at_s in flat]).reshape(-1, len(self.landmarks), 3)


def detected(
    recipe: Recipe, scene: Scene, trackers: Mapping[str, Without] | None = None
) -> dict[str, list[MarkerFrame]]:
    """All cameras' frames in order of exposure, with what each tracker detects in their pictures.

    trackers: contexts in which a tracker works, by name; each tracker has a state of its own.
    """
    trackers = trackers or {"": contextlib.nullcontext}
    found: dict[str, list[tuple[float, MarkerFrame]]] = {name: [] for name in trackers}
    calibration = recipe.scene(seed=recipe.seed + 1000)
    for camera in scene.cameras:
        colors = fitted_colors(calibration, camera)
        steps = {name: step_of_rig(scene.config, camera, colors) for name in trackers}
        for time_s, frame in taken(recipe, scene, camera):
            for name, without in trackers.items():
                with without():
                    markers = steps[name].step(frame, 0, CLOCK_SIGMA_NS)
                found[name].append((time_s, markers))
    return {
        name: [frame for _, frame in sorted(frames, key=lambda entry: entry[0])]
        for name, frames in found.items()
    }


def taken(recipe: Recipe, scene: Scene, camera: str) -> Iterator[tuple[float, Frame]]:
    """A camera's pictures as its tracker gets them, and when they are exposed, s."""
    source = FrameSource(scene, camera, recorded=True)
    for seq in range(int(recipe.seconds * scene.config.camera_named(camera).fps)):
        shot = source.take(seq, START_NS)
        if shot.image is not None:
            yield shot.time_s, frame_of(shot, full_range=recipe.wrong_range)


def frame_of(shot: TakenFrame, *, full_range: bool = False) -> Frame:
    """A picture as a camera hands it to the tracker; full_range: it is taken for one."""
    assert shot.image is not None
    return Frame(
        shot.camera,
        shot.seq,
        shot.stamp_ns,
        shot.row_time_ns,
        shot.size_px,
        shot.image,
        "i420",
        full_range,
    )


def fitted_colors(scene: Scene, camera: str) -> Colors:
    """Colour ranges as somebody calibrates them who clicks on the paint in this light."""
    renderer = Renderer(scene, camera)
    by_surface, other = sample_pixels(renderer, _CALIBRATION_FRAMES)
    surfaces = renderer.shapes.paint_surfaces
    painted = {
        color: by_surface[surfaces[name, landmark]]
        for name, hand in scene.hands.items()
        for landmark, color in hand.landmarks.items()
    }
    return fit_ranges(painted, other, "", "testing/families")


def visible_shares(recipe: Recipe, scene: Scene) -> dict[str, Array]:
    """Of each camera, the share of each landmark's paint that is visible in each frame; (f, L)."""
    ((hand, painted),) = ((name, item.landmarks) for name, item in scene.hands.items())
    shares = {}
    for name in scene.cameras:
        source = FrameSource(scene, name, recorded=True)
        count = int(recipe.seconds * scene.config.camera_named(name).fps)
        table = np.zeros((count, len(painted)))
        rows = np.arange(0, count, _VISIBILITY_STEP)
        for seq in rows.tolist():
            patches = patch_visibility(source.renderer, source.frame_time(seq).time_s)
            for column, landmark in enumerate(painted):
                table[seq, column] = patches[hand, landmark].share
        for seq in np.setdiff1d(np.arange(count), rows).tolist():
            table[seq] = np.minimum(table[seq - 1], table[min(seq + 1, rows[-1])])
        shares[name] = table
    return shares
