"""Pictures of a scene as one camera takes them. Pure: the same (scene, camera, frame) gives the
same bytes.

A renderer belongs to one thread: it owns its buffers. Its kernels release the GIL. What lies
outside the picture or nearer than 2 cm is not drawn. The first picture compiles the kernels (cached
on disk).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.simulator.render import develop
from services.simulator.render.antialias import outlines, patterns, retrace, widen
from services.simulator.render.motion_paths import motions, points, rows_of
from services.simulator.render.ray_capsule import FAR, lens_of, rays_of
from services.simulator.render.shade import lights_of, surfaces_of, texture
from services.simulator.render.trace import Film, World, trace
from services.simulator.scene.backdrop import backdrop, vignette, wall
from services.simulator.scene.bodies import HAND_FRAMES, ShapeArrays, Shapes, add_hand, arrays
from services.simulator.scene.paints import CUP, SKIN, TRACKER, Surface, paint
from services.simulator.scene.scene import Scene

Bytes = npt.NDArray[np.uint8]
# Cameras differ in their white balance by a few per cent.
_GAIN_SIGMA = 0.015


@dataclass(frozen=True, eq=False)
class Cast:
    """Every body of a scene and how it looks.

    marks: (hand, landmark) -> surface number of its paint.
    """

    shapes: ShapeArrays
    surfaces: list[Surface]
    marks: dict[tuple[str, str], int]


def cast_of(scene: Scene) -> Cast:
    """Bodies and surfaces of a scene; surface 0 is skin.

    Raises ConfigError for a colour no paint has.
    """
    shapes, surfaces = Shapes(), [SKIN, CUP, TRACKER]
    marks: dict[tuple[str, str], int] = {}
    for number, hand in enumerate(scene.hands.values()):
        paints: dict[str, int] = {}
        for landmark, color in hand.landmarks.items():
            paints[landmark] = marks[hand.name, landmark] = len(surfaces)
            surfaces.append(paint(color))
        add_hand(shapes, hand.model, number * HAND_FRAMES, 0, paints)
    first = HAND_FRAMES * len(scene.hands)
    for number, thing in enumerate(scene.things):
        frame = first + number
        shapes.capsule((frame, (0.0, -0.055, 0.0), 0.018), (frame, (0.0, 0.055, 0.0), 0.018), 1)
        x, y, z = thing.T_object_from_tracker[:3, 3].tolist()
        shapes.capsule((frame, (x - 0.012, y, z), 0.024), (frame, (x + 0.012, y, z), 0.024), 2)
    return Cast(arrays(shapes), surfaces, marks)


class Renderer:
    """Takes the pictures of one camera of a scene."""

    def __init__(self, scene: Scene, camera: str) -> None:
        self.scene = scene
        self.camera: Camera = scene.cameras[camera]
        self.clock = scene.clocks[camera]
        self.cast = cast_of(scene)
        number = list(scene.cameras).index(camera)
        first = next(iter(scene.cameras.values()))
        rng = np.random.default_rng([scene.seed, 23, number])
        gains = 1.0 + _GAIN_SIGMA * rng.standard_normal(3)
        self._seed = scene.seed * 64 + number
        self._prepare_light(first, gains)
        self._develop_backdrop()

    def _prepare_light(self, first: Camera, gains: Array) -> None:
        scene, camera = self.scene, self.camera
        width, height = camera.size_px
        rays = rays_of(camera)
        self._lens = lens_of(camera)
        T = camera.T_camera_from_rig
        self._R, self._p = np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3])
        shade = vignette(rays)
        sharp = (
            backdrop(camera, first, wall(scene.seed, scene.spec.clutter), rays, gains)
            * shade[..., None]
        )
        self._film = Film(
            rays=rays,
            vignette=shade,
            backdrop=sharp,
            depth=np.full((height, width), FAR, np.float32),
            owner=np.zeros((height, width), np.int16),
            label=np.zeros((height, width), np.int16),
            flags=np.zeros((height, width), np.uint8),
            ranges=np.zeros((height, 2), np.int64),
            picture=sharp.copy(),
            pattern=patterns(),
        )
        self._world = self._make_world(
            lights_of(scene.spec.light, T[:3, :3] @ first.T_rig_from_camera[:3, :3]), gains
        )
        self._curve, self._weights = develop.tone_curve(), develop.blur_weights(scene.spec.blur_px)
        self._bank = develop.noise_bank(height, width, self._seed)

    def _make_world(self, lights: Array, gains: Array) -> World:
        s = self.cast.shapes
        count, dabs = len(s.frame), len(s.dab_frame)
        return World(
            ends=np.empty((count, 2, 3, 3)),
            palms=np.empty((count, 3, 3)),
            tracks=np.empty((count, 2, 3, 3)),
            spans=np.empty((count, 2), np.int64),
            radius=s.radius,
            kind=s.kind,
            end_m=s.end_m,
            dabs=np.empty((dabs, 3, 3)),
            dab_r2=s.dab_radius**2,
            dab_surface=s.dab_surface,
            looks=surfaces_of(self.cast.surfaces, gains),
            lights=lights,
            blotches=texture(self.scene.seed),
        )

    def _develop_backdrop(self) -> None:
        width, height = self.camera.size_px
        film = self._film
        self._scratch, self._soft = np.empty_like(film.backdrop), np.empty_like(film.backdrop)
        everything = np.tile([0, width - 1], (height, 1))
        self._reach = everything.copy()
        self._luma, self._chroma = (
            np.empty((height, width), np.float32),
            np.empty((2, height // 2, width // 2), np.float32),
        )
        develop.blur(everything, self._weights, film.backdrop, self._scratch, self._soft)
        develop.develop(everything, self._curve, self._soft, self._luma, self._chroma)
        self._bare = self._luma.copy(), self._chroma.copy()
        self._drawn: Array | None = None

    def picture(self, frame: int) -> Bytes:
        """Frame number `frame` as I420 (h * 3 / 2, w), with everything a camera adds."""
        self._draw(self.clock.time_s(frame))
        return self._expose(frame, self.scene.spec.noise)

    def clean(self, time_s: float) -> Bytes:
        """The picture whose row 0 is exposed about time_s, without noise; I420."""
        self._draw(time_s)
        return self._expose(0, 0.0)

    @property
    def light(self) -> npt.NDArray[np.float32]:
        """Linear light of the last picture before the lens blurs it; (h, w, 3).

        Overwritten by the next picture.
        """
        return self._film.picture

    def labels(
        self, time_s: float, only: npt.NDArray[np.bool_] | None = None
    ) -> npt.NDArray[np.int16]:
        """Which surface each pixel's middle sees, each row at mid-exposure: 0 background, 1 skin, 1
        + Cast.marks[...] paint; (h, w).

        only (c,) says which capsules are there; default all.
        """
        self._wipe()
        self._trace(time_s, only)
        return self._film.label.copy()

    def _expose(self, frame: int, noise: float) -> Bytes:
        width, height = self.camera.size_px
        out = np.empty((height * 3 // 2, width), np.uint8)
        row, column = develop.noise_offsets(self._seed, frame)
        sign = 1.0 if (frame ^ (row >> 1)) & 1 else -1.0
        develop.expose(
            self._luma,
            self._chroma,
            *self._bank,
            row,
            column,
            sign,
            noise / develop.NOISE_UNIT,
            out,
        )
        return out

    def _draw(self, time_s: float) -> None:
        """Everything up to the unrounded planes."""
        self._wipe()
        timing, shutter = self._trace(time_s)
        longest = outlines(self._world, self._film, shutter)
        # What moves reaches beyond where it was in the middle of the exposure, and the lens spreads
        # it further.
        widen(self._film.ranges, int(0.5 * longest) + 5, self._reach)
        np.minimum(self._reach[:, 1], self.camera.size_px[0] - 1, out=self._reach[:, 1])
        self._drawn = self._bounds(self._reach)
        retrace(self._world, self._film, timing, shutter, longest, self._reach)
        develop.blur(self._reach, self._weights, self._film.picture, self._scratch, self._soft)
        develop.develop(self._reach, self._curve, self._soft, self._luma, self._chroma)

    def _wipe(self) -> None:
        """Bring the background back where the last picture covered it."""
        if self._drawn is None:
            return
        y0, y1, x0, x1 = self._drawn[0], self._drawn[1] + 1, self._drawn[2], self._drawn[3] + 1
        film = self._film
        film.picture[y0:y1, x0:x1] = film.backdrop[y0:y1, x0:x1]
        film.depth[y0:y1, x0:x1] = FAR
        film.label[y0:y1, x0:x1] = 0
        film.flags[y0:y1, x0:x1] = 0
        self._luma[y0:y1, x0:x1] = self._bare[0][y0:y1, x0:x1]
        self._chroma[:, y0 // 2 : y1 // 2, x0 // 2 : x1 // 2] = self._bare[1][
            :, y0 // 2 : y1 // 2, x0 // 2 : x1 // 2
        ]
        self._drawn = None

    def _trace(
        self, time_s: float, only: npt.NDArray[np.bool_] | None = None
    ) -> tuple[Array, float]:
        """One ray a pixel; returns (u of row 0 and step a row), and the exposure in units of u."""
        height = self.camera.size_px[1]
        row_s, exposure_s = self.clock.row_time_ns * 1e-9, self.clock.exposure_s
        half_s = 0.5 * ((height - 1) * row_s + exposure_s)
        middle_s = time_s + 0.5 * (height - 1) * row_s
        bodies = [self.scene.bodies(middle_s + k * half_s) for k in (-1, 0, 1)]
        positions, rotations = (
            np.stack([b.positions for b in bodies]),
            np.stack([b.rotations for b in bodies]),
        )
        s, w = self.cast.shapes, self._world
        motions(
            positions,
            rotations,
            self._R,
            self._p,
            self._lens,
            s.frame,
            s.offset,
            s.radius,
            w.ends,
            w.palms,
            w.tracks,
        )
        points(positions, rotations, self._R, self._p, s.dab_frame, s.dab_offset, w.dabs)
        rows_of(w.tracks, height, w.spans)
        if only is not None:
            w.spans[~only] = (height, -1)
        timing = np.array([(time_s - middle_s) / half_s, row_s / half_s])
        trace(w, self._film, timing)
        self._drawn = self._bounds(self._film.ranges)
        return timing, exposure_s / half_s

    def _bounds(self, ranges: npt.NDArray[np.int64]) -> Array | None:
        """First and last row and column of all ranges (h, 2), on even boundaries.

        None if they are empty.
        """
        rows = np.flatnonzero(ranges[:, 1] >= ranges[:, 0])
        if not len(rows):
            return None
        first, last = int(ranges[rows, 0].min()), int(ranges[rows, 1].max())
        return np.array(
            [rows[0] // 2 * 2, rows[-1] // 2 * 2 + 1, first // 2 * 2, last // 2 * 2 + 1]
        )
