"""What `rhot grasp rectify` reads and writes: pictures, lenses, a plane's own file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import msgspec
import numpy as np
import numpy.typing as npt

from rhot.errors import UNDECODABLE, CaptureError, ConfigError, writing
from rhot.files.calibration import Lens, load
from rhot.geometry.camera import Camera
from rhot.geometry.transforms import Array
from services.cli.grasp.film import open_video
from studies.grasp.metrology.lens import lens_from_edges, straightened
from studies.grasp.metrology.plane import Plane
from studies.grasp.metrology.rectified import Raster, Rectified, raster_of
from studies.grasp.metrology.reference import Known, Reference, parse_points, plane_of

Image = npt.NDArray[np.uint8]
# Rates that a container may say; others are a broken header.
_FPS, _FPS_RANGE = 30.0, (0.1, 1000.0)


class PlaneFile(msgspec.Struct, frozen=True, kw_only=True):
    """plane.json. image_from_plane takes (x, y, 1) in mm to homogeneous pixels of a picture without
    distortion, covariance (9, 9) is of it row by row; corner_mm is the rectified picture's upper
    left pixel.
    """

    image_from_plane: list[list[float]]
    covariance: list[list[float]]
    matrix: list[list[float]] | None
    distortion: list[float] | None
    size_px: tuple[int, int]
    px_per_mm: float
    corner_mm: tuple[float, float]


class Straight(NamedTuple):
    """What is known of a lens, for pictures of size_px. calibrated: its matrix, where the focal
    length is known; about: in words.
    """

    size_px: tuple[int, int]
    matrix: Array | None
    distortion: Array
    calibrated: Array | None
    about: str

    def straighten(self, points_px: npt.ArrayLike) -> Array:
        """Pixels (n, 2) of the camera to those of a picture without distortion."""
        points = np.asarray(points_px, dtype=np.float64).reshape(-1, 2)
        if self.matrix is None:
            return points
        flat = straightened(points, self.matrix, self.distortion)
        if not np.isfinite(flat).all():
            raise ConfigError(
                f"a point of {points.round(1).tolist()} lies where the lens's model reaches no"
                " more; is it the lens of this camera, and of this size of pictures?"
            )
        return flat

    def known(self, reference: Reference, sigma_px: float, picture: Image | None) -> Known:
        """The plane of a reference in the camera's pixels."""
        return plane_of(
            reference,
            self.size_px,
            straighten=self.straighten,
            matrix=self.calibrated,
            sigma_px=sigma_px,
            picture=picture,
        )

    def as_lens(self) -> Lens | None:
        """As a calibration has it; None of one without distortion."""
        if self.matrix is None:
            return None
        rows = [tuple(row) for row in self.matrix.tolist()]
        distortion = tuple(self.distortion.tolist())
        return Lens(size_px=self.size_px, matrix=(rows[0], rows[1], rows[2]), distortion=distortion)

    def distort(self, points_px: Array) -> Array:
        """Back; (n, 2)."""
        if self.matrix is None:
            return points_px
        camera = Camera("lens", self.size_px, self.matrix, self.distortion, np.eye(4))
        focal = (self.matrix[0, 0], self.matrix[1, 1])
        rays = (points_px - self.matrix[:2, 2]) / focal
        # Beyond the picture's corners a barrel lens folds back in.
        reach = np.abs(camera.rays_from_pixels(_corners(self.size_px)))
        limit = 1.3 * float(np.nanmax(np.hypot(*reach.T), initial=0.5))
        rays = np.where((np.hypot(*rays.T) < limit)[:, None], rays, np.nan)
        return camera.pixels_from_rays(rays)


def straight_of(size_px: tuple[int, int], lens: Path | None, edges: Path | None) -> Straight:
    """From a calibration, from straight edges, or none."""
    if lens is not None and edges is not None:
        raise ConfigError("--lens and --straight both say how the lens bends; give one")
    if lens is not None:
        file = load(lens, Lens, "rhot calibrate lens")
        if file.size_px != size_px:
            seen, known = (f"{w}x{h}" for w, h in (size_px, file.size_px))
            raise ConfigError(
                f"{lens}: was calibrated at {known}, and the picture is {seen}; calibrate the lens"
                " at this size"
            )
        matrix = np.array(file.matrix)
        return Straight(size_px, matrix, np.array(file.distortion), matrix, f"lens: {lens}")
    if edges is None:
        about = "lens: taken for one without distortion (--lens, --straight)"
        return Straight(size_px, None, np.zeros(5), None, about)
    found = lens_from_edges(_edges(edges), size_px)
    sigma = np.sqrt(np.diag(found.covariance))
    about = (
        f"lens: k1 {found.distortion[0]:.4f} +- {sigma[0]:.4f}, k2 {found.distortion[1]:.4f} +-"
        f" {sigma[1]:.4f} for a focal length of {found.matrix[0, 0]:.0f} px; edges were bent by"
        f" {found.bend_px:.2f} px RMS, and are by {found.rms_px:.2f}"
    )
    return Straight(size_px, found.matrix, found.distortion, None, about)


def _edges(path: Path) -> list[list[tuple[float, float]]]:
    try:
        return msgspec.json.decode(path.read_bytes(), type=list[list[tuple[float, float]]])
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    except UNDECODABLE as error:
        raise ConfigError(
            f"{path}: holds no edges ({error}); it should be [[[x, y], [x, y], [x, y]], ...], the"
            " points along each edge in pixels"
        ) from None


def first_picture(path: Path) -> Image:
    """Of a picture or video."""
    for image in _pictures(path):
        return image
    raise CaptureError(f"{path}: holds no picture that can be decoded")


def _pictures(path: Path) -> Iterator[Image]:
    if not path.is_file():
        raise CaptureError(f"{path}: no such picture or video")
    image = cv2.imread(str(path), cv2.IMREAD_COLOR) if cv2.haveImageReader(str(path)) else None
    if image is not None:
        yield np.asarray(image, dtype=np.uint8)
        return
    video = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    try:
        while video.isOpened():
            fine, image = video.read()
            if not fine:
                return
            yield np.asarray(image, dtype=np.uint8)
    finally:
        video.release()


def measure_distance(plane: Plane, straight: Straight, text: str, sigma_px: float) -> str:
    """`x,y x,y: 36.21 mm +- 0.43`."""
    ends = straight.straighten(parse_points(text, 2))
    length, sigma = plane.distance(ends[0], ends[1], sigma_px)
    return f"{text}: {length:.2f} mm +- {sigma:.2f}"


def write(
    source: Path,
    out: Path,
    plane: Plane,
    straight: Straight,
    about_px: Array,
    px_per_mm: float | None,
    advance: Callable[[], None],
) -> Iterator[Path]:
    """plane.json, and rectified.png or .mp4; each path once it is written."""
    raster = raster_of(plane, straight.size_px, about_px, px_per_mm)
    rectified = Rectified(plane, raster, straight.distort)
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
        file = msgspec.json.encode(_plane_file(plane, straight, raster))
        (out / "plane.json").write_bytes(msgspec.json.format(file, indent=1) + b"\n")
    yield out / "plane.json"
    if cv2.haveImageReader(str(source)):
        path = out / "rectified.png"
        if not cv2.imwrite(str(path), rectified.picture(first_picture(source))):
            raise CaptureError(f"{path}: cannot be written; is the disk full?")
        yield path
        return
    path = out / "rectified.mp4"
    video = open_video(path, "mp4v", _rate(source), raster.size_px)
    try:
        for image in _pictures(source):
            video.write(rectified.picture(image))
            advance()
    finally:
        video.release()
    yield path


def _plane_file(plane: Plane, straight: Straight, raster: Raster) -> PlaneFile:
    bent = straight.matrix is not None
    return PlaneFile(
        image_from_plane=plane.image_from_plane.tolist(),
        covariance=plane.covariance.tolist(),
        matrix=straight.matrix.tolist() if straight.matrix is not None else None,
        distortion=straight.distortion.tolist() if bent else None,
        size_px=raster.size_px,
        px_per_mm=raster.px_per_mm,
        corner_mm=(float(raster.corner_mm[0]), float(raster.corner_mm[1])),
    )


def _rate(path: Path) -> float:
    video = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    fps = float(video.get(cv2.CAP_PROP_FPS))
    video.release()
    return fps if _FPS_RANGE[0] <= fps <= _FPS_RANGE[1] else _FPS


def _corners(size_px: tuple[int, int]) -> Array:
    width, height = size_px
    return np.array([(0, 0), (width - 1, 0), (width - 1, height - 1), (0, height - 1)], float)
