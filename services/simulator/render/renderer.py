"""Pictures of a scene as one camera takes them. Pure: the same (scene, camera, frame) gives the
same bytes.

A renderer belongs to one thread: it owns its buffers. Its kernels release the GIL. What lies
outside the picture or nearer than 2 cm is not drawn. The first picture compiles the kernels (cached
on disk).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.simulator.board.draw import Canvas, RowTimes, bounds, draw_board, homographies
from services.simulator.board.sheet import INK, PAPER, printed
from services.simulator.hands.bodies import Ints
from services.simulator.render import develop
from services.simulator.render.antialias import supersample
from services.simulator.render.buffers import (
    FrameBuffers,
    FrameTiming,
    SceneArrays,
    camera_view,
    capsule_paths,
    dab_paths,
    frame_buffers,
)
from services.simulator.render.edges import flag_edges, widen_columns
from services.simulator.render.materials import (
    AMBIENT,
    FILL,
    KEY,
    flicker_gains,
    surfaces_in_light,
)
from services.simulator.render.motion_paths import (
    BodyPoses,
    find_rows,
    trace_capsules,
    trace_dabs,
)
from services.simulator.render.noise import NoiseDraw, add_noise, draw_noise, noise_bank
from services.simulator.render.projection import Array32, pixel_rays
from services.simulator.render.ray_capsule import FAR
from services.simulator.render.shade import light_on
from services.simulator.render.trace import trace
from services.simulator.scene.backdrop import backdrop, vignette, wall_texture
from services.simulator.scene.scene import Scene
from services.simulator.scene.scene_shapes import scene_shapes

Bytes = npt.NDArray[np.uint8]
Labels = npt.NDArray[np.int16]
Capsules = npt.NDArray[np.bool_]
# Cameras differ in their white balance by a few per cent.
_GAIN_SIGMA = 0.015
# How far lens blur and the widened edges reach beyond what moves, px.
_MARGIN_PX = 5


class Renderer:
    """Takes the pictures of one camera of a scene.

    shapes is every body of the scene; clock says when each frame is exposed.
    """

    def __init__(self, scene: Scene, camera: str, *, full_range: bool = False) -> None:
        """full_range: pictures have Y in 0..255 instead of 16..235."""
        self.full_range = full_range
        self.scene = scene
        self.camera: Camera = scene.cameras[camera]
        self.clock = scene.clocks[camera]
        self.shapes = scene_shapes(scene)
        number = list(scene.cameras).index(camera)
        first = next(iter(scene.cameras.values()))
        rng = np.random.default_rng([scene.seed, 23, number])
        gains = 1.0 + _GAIN_SIGMA * rng.standard_normal(3)
        self._gains = gains
        self._seed = scene.seed * 64 + number
        self._view = camera_view(self.camera)
        self._buffers = self._make_buffers(first, gains)
        self._arrays = self._make_scene_arrays(first, gains)
        self._develop_backdrop()

    def _make_buffers(self, first: Camera, gains: Array) -> FrameBuffers:
        """Buffers that show the backdrop as this camera sees it."""
        rays = pixel_rays(self.camera)
        shade = vignette(rays)
        wall = wall_texture(self.scene.seed, self.scene.spec.clutter)
        sharp = backdrop(self.camera, first, wall, rays, gains) * shade[..., None]
        return frame_buffers(rays, shade, sharp)

    def _make_scene_arrays(self, first: Camera, gains: Array) -> SceneArrays:
        """Bodies, surfaces and light, in this camera's frame."""
        R_camera_from_rig = self.camera.T_camera_from_rig[:3, :3]
        R_camera_from_first = R_camera_from_rig @ first.T_rig_from_camera[:3, :3]
        return SceneArrays(
            capsules=capsule_paths(self.shapes.arrays),
            dabs=dab_paths(self.shapes.arrays),
            surfaces=surfaces_in_light(
                self.shapes.surfaces,
                gains,
                self.scene.spec.light,
                R_camera_from_first,
                self.scene.seed,
                self.shapes.meshes.normals,
            ),
            meshes=self.shapes.meshes,
        )

    def _develop_backdrop(self) -> None:
        """Make the planes of the picture, and fill them with the backdrop."""
        width, height = self.camera.size_px
        self._weights = develop.blur_weights(self.scene.spec.blur_px)
        self._curve = develop.tone_curve()
        self._noise_bank = noise_bank(height, width, self._seed)
        backdrop_light = self._buffers.backdrop
        self._scratch, self._blurred = np.empty_like(backdrop_light), np.empty_like(backdrop_light)
        self._planes = develop.empty_planes(width, height)
        # Columns of each row that are drawn anew.
        self._wide: Ints = np.tile([0, width - 1], (height, 1))
        self._develop(backdrop_light)
        self._backdrop_planes = develop.copy_planes(self._planes)
        # First and last row and column that differ from the backdrop, None if none does.
        self._changed: Ints | None = None
        # A board that is held still before things that rest: where the planes show it. Drawing it
        # takes 25 ms of a desktop computer's time, noise 5.
        self._held: Array | None = None
        resting = all(item.sweep is None and item.holder is None for item in self.scene.objects)
        self._board_alone = resting and not self.scene.hands

    def picture(self, frame: int) -> Bytes:
        """Frame number `frame` as I420 (h * 3 / 2, w), with everything a camera adds."""
        time_s = self.clock.time_s(frame)
        self._draw(time_s)
        return self._finish(draw_noise(self._seed, frame, self.scene.spec.noise), time_s)

    def clean(self, time_s: float) -> Bytes:
        """The picture whose row 0 is exposed about time_s, without noise; I420."""
        self._draw(time_s)
        return self._finish(draw_noise(self._seed, 0, 0.0), time_s)

    @property
    def light(self) -> Array32:
        """Linear light of the last picture before the lens blurs it; (h, w, 3).

        Overwritten by the next picture.
        """
        return self._buffers.light

    def labels(self, time_s: float, only: Capsules | None = None) -> Labels:
        """Which surface the middle of each pixel sees, each row at mid-exposure; (h, w).

        0 is the backdrop, 1 skin, 1 + SceneShapes.paint_surfaces[...] paint. only (c,) says which
        capsules are there; default all.
        """
        self._restore_backdrop()
        self._trace(time_s, only)
        return self._buffers.label.copy()

    def _finish(self, draw: NoiseDraw, time_s: float) -> Bytes:
        width, height = self.camera.size_px
        out = np.empty((height * 3 // 2, width), np.uint8)
        planes = self._planes
        if self.scene.spec.light.flicker:
            rows_s = time_s + 1e-9 * self.clock.row_time_ns * np.arange(height, dtype=float)
            gains = flicker_gains(self.scene.spec.light, rows_s, self.clock.exposure_s)
            planes = develop.dimmed(planes, gains)
        if self.full_range:
            planes, draw = develop.full_range(planes), draw.scaled(develop.FULL_OVER_LIMITED)
        add_noise(planes, self._noise_bank, draw, out)
        return out

    def _draw(self, time_s: float) -> None:
        """Everything up to the unrounded planes."""
        board = self._reach_board(time_s)
        if board and self._held is not None and np.array_equal(board[0], self._held):
            return
        self._restore_backdrop()
        timing = self._trace(time_s)
        if board is not None:
            self._widen_to(board[1])
        longest = flag_edges(self._arrays.capsules, self._buffers, timing.exposure)
        # What moves reaches beyond where it was in the middle of the exposure.
        widen_columns(self._buffers.columns, int(0.5 * longest) + _MARGIN_PX, self._wide)
        np.minimum(self._wide[:, 1], self.camera.size_px[0] - 1, out=self._wide[:, 1])
        self._changed = _bounds(self._wide)
        supersample(self._arrays, self._buffers, timing, longest, self._wide)
        if board is not None:
            self._draw_board(*board, timing)
            self._held = board[0] if self._board_alone else None
        self._develop(self._buffers.light)

    def _reach_board(self, time_s: float) -> tuple[Array, Ints] | None:
        """Poses (3, 4, 4) of the scene's board during a frame, and the first and last row and
        column (4,) that it touches; None if no board is seen.
        """
        board = self.scene.board
        if board is None:
            return None
        middle_s, half_s = self._exposed(time_s)
        poses = np.stack([board.pose(middle_s + k * half_s) for k in (-1, 0, 1)])
        box = bounds(self.camera, printed(board.kind), poses)
        return None if box is None else (poses, box)

    def _widen_to(self, box: Ints) -> None:
        """Count these rows and columns among those that are drawn anew."""
        columns = self._buffers.columns[box[0] : box[1] + 1]
        np.minimum(columns[:, 0], box[2], out=columns[:, 0])
        np.maximum(columns[:, 1], box[3], out=columns[:, 1])

    def _draw_board(self, poses: Array, box: Ints, timing: FrameTiming) -> None:
        """The board, matt on both sides, over what is behind it."""
        board = self.scene.board
        if board is None:
            return
        T_camera_from_board = self.camera.T_camera_from_rig @ poses
        middle = T_camera_from_board[1]
        away = middle[:3, 2] @ middle[:3, 3] >= 0.0
        x, y, z = -middle[:3, 2] if away else middle[:3, 2]
        lights = self._arrays.surfaces.lights
        key, fill, _, sky, _ = light_on(lights, (x, y, z), (0.0, 0.0, 1.0))
        light = (lights[KEY] * key + lights[FILL] * fill + lights[AMBIENT] * sky) * self._gains
        # Nothing is printed on its back.
        tones = np.outer((INK if away else PAPER, PAPER), light)
        buffers = self._buffers
        canvas = Canvas(buffers.rays, buffers.vignette, buffers.depth, buffers.light)
        path = homographies(T_camera_from_board)
        draw_board(printed(board.kind), path, RowTimes(*timing), box, tones, canvas)

    def _develop(self, light: Array32) -> None:
        """From light to planes, in the columns that are drawn anew."""
        develop.blur(self._wide, self._weights, light, self._scratch, self._blurred)
        develop.to_yuv420(self._wide, self._curve, self._blurred, self._planes)

    def _restore_backdrop(self) -> None:
        """Undo the last picture."""
        self._held = None
        if self._changed is None:
            return
        first_row, last_row, first_column, last_column = self._changed.tolist()
        rows, columns = slice(first_row, last_row + 1), slice(first_column, last_column + 1)
        buffers = self._buffers
        buffers.light[rows, columns] = buffers.backdrop[rows, columns]
        buffers.depth[rows, columns] = FAR
        buffers.label[rows, columns] = 0
        buffers.flags[rows, columns] = 0
        develop.copy_part(self._backdrop_planes, self._planes, rows, columns)
        self._changed = None

    def _exposed(self, time_s: float) -> tuple[float, float]:
        """The middle of a frame whose row 0 is exposed about time_s, and half its length; s."""
        to_last_s = (self.camera.size_px[1] - 1) * (self.clock.row_time_ns * 1e-9)
        return time_s + 0.5 * to_last_s, 0.5 * (to_last_s + self.clock.exposure_s)

    def _trace(self, time_s: float, only: Capsules | None = None) -> FrameTiming:
        """One ray a pixel of the frame whose row 0 is exposed about time_s."""
        height = self.camera.size_px[1]
        row_s, exposure_s = self.clock.row_time_ns * 1e-9, self.clock.exposure_s
        middle_s, half_s = self._exposed(time_s)
        frames = [self.scene.body_frames(middle_s + k * half_s) for k in (-1, 0, 1)]
        poses = BodyPoses(
            np.stack([f.positions for f in frames]), np.stack([f.rotations for f in frames])
        )
        capsules = self._arrays.capsules
        trace_capsules(poses, self._view, capsules)
        trace_dabs(poses, self._view, self._arrays.dabs)
        find_rows(capsules.tracks, height, capsules.rows)
        if only is not None:
            capsules.rows[~only] = (height, -1)
        timing = FrameTiming(
            first_row=(time_s - middle_s) / half_s,
            row_step=row_s / half_s,
            exposure=exposure_s / half_s,
        )
        trace(self._arrays, self._buffers, timing)
        self._changed = _bounds(self._buffers.columns)
        return timing


def _bounds(columns: Ints) -> Ints | None:
    """First and last row and column of the touched columns (h, 2) of all rows, on even boundaries.

    None if there are none.
    """
    rows = np.flatnonzero(columns[:, 1] >= columns[:, 0])
    if not len(rows):
        return None
    first, last = int(columns[rows, 0].min()), int(columns[rows, 1].max())
    return np.array([rows[0] // 2 * 2, rows[-1] // 2 * 2 + 1, first // 2 * 2, last // 2 * 2 + 1])
