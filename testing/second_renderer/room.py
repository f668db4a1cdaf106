"""Lamps, and a room with things in it, for VTK. Metres, in the rig's frame (x right, y down)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from testing.second_renderer.motion import Array

Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Lamp:
    """A lamp at a place, with its colour times its strength; shadows are hard."""

    place: tuple[float, float, float]
    color: Rgb


@dataclass(frozen=True)
class Light:
    """The lamps of a room, and what comes from the cameras' side without shadow."""

    lamps: tuple[Lamp, ...] = (
        Lamp((-0.6, -1.0, -0.3), (4.2, 4.1, 3.9)),
        Lamp((0.9, -0.5, -0.2), (2.2, 2.25, 2.4)),
    )
    ambient: Rgb = (1.4, 1.4, 1.45)


def add_lamps(renderer: Any, light: Light, target: Array) -> None:
    """Put lamps into a VTK renderer; they shine at the target."""
    renderer.RemoveAllLights()
    renderer.AutomaticLightCreationOff()
    for lamp in light.lamps:
        one = vtk.vtkLight()
        one.SetLightTypeToSceneLight()
        one.SetPositional(True)
        one.SetConeAngle(40.0)
        one.SetExponent(0.0)
        one.SetPosition(*lamp.place)
        one.SetFocalPoint(*target.tolist())
        one.SetColor(*(np.array(lamp.color) / max(lamp.color)).tolist())
        one.SetIntensity(max(lamp.color))
        renderer.AddLight(one)
    # Far lamps without shadows stand for what walls throw back.
    for place, share in (
        ((-3.0, 1.0, -2.0), 0.5),
        ((3.0, 0.4, -2.0), 0.35),
        ((0.0, -4.0, 0.8), 0.4),
    ):
        one = vtk.vtkLight()
        one.SetLightTypeToSceneLight()
        one.SetPositional(True)
        one.SetConeAngle(170.0)
        one.SetPosition(*place)
        one.SetFocalPoint(*target.tolist())
        one.SetColor(*(np.array(light.ambient) / max(light.ambient)).tolist())
        one.SetIntensity(max(light.ambient) * share)
        renderer.AddLight(one)


def matt(actor: Any, roughness: float = 0.75, color: Rgb = (1.0, 1.0, 1.0)) -> None:
    """A physically based surface."""
    of = actor.GetProperty()
    of.SetInterpolationToPBR()
    of.SetMetallic(0.0)
    of.SetRoughness(roughness)
    of.SetColor(*color)


def add_room(renderer: Any, seed: int) -> None:
    """A wall with pictures, a table, and things on it and behind."""
    rng = np.random.default_rng([seed, 9])
    wall = _plane((-2.2, -1.6, 2.3), (2.3, -1.6, 2.3 + rng.uniform(-0.3, 0.3)), (-2.2, 1.2, 2.3))
    _textured(renderer, wall, _wall(rng))
    table = _plane((-1.6, 0.42, 0.5), (1.6, 0.42, 0.5), (-1.6, 0.42, 2.3))
    _textured(renderer, table, _wood(rng))
    colors: list[Rgb] = [
        (0.45, 0.05, 0.04), (0.10, 0.13, 0.24), (0.55, 0.42, 0.08), (0.30, 0.30, 0.30),
        (0.10, 0.18, 0.08), (0.60, 0.58, 0.52), (0.30, 0.15, 0.07), (0.04, 0.04, 0.05),
    ]  # fmt: skip
    for k, color in enumerate(colors):
        at = (-1.0 + 0.27 * k + rng.uniform(-0.1, 0.1), 0.42, rng.uniform(1.1, 2.0))
        _thing(renderer, k % 4, at, rng.uniform(0.05, 0.13), color)


def _thing(renderer: Any, kind: int, foot: Rgb, size: float, color: Rgb) -> None:
    x, y, z = foot
    source: Any
    if kind == 0:
        source = vtk.vtkSphereSource()
        source.SetRadius(size)
        source.SetThetaResolution(48)
        source.SetPhiResolution(48)
        height = size
    elif kind == 1:
        source = vtk.vtkCubeSource()
        source.SetXLength(1.2 * size)
        source.SetYLength(3.0 * size)
        source.SetZLength(size)
        height = 1.5 * size
    elif kind == 2:
        source = vtk.vtkCylinderSource()
        source.SetRadius(0.6 * size)
        source.SetHeight(2.0 * size)
        source.SetResolution(48)
        height = size
    else:
        source = vtk.vtkConeSource()
        source.SetRadius(size)
        source.SetHeight(2.5 * size)
        source.SetDirection(0.0, -1.0, 0.0)
        source.SetResolution(48)
        height = 1.25 * size
    source.SetCenter(x, y - height, z)
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputConnection(source.GetOutputPort())
    actor.SetMapper(mapper)
    matt(actor, 0.5, color)
    renderer.AddActor(actor)


def _plane(origin: Rgb, first: Rgb, second: Rgb) -> Any:
    plane = vtk.vtkPlaneSource()
    plane.SetOrigin(*origin)
    plane.SetPoint1(*first)
    plane.SetPoint2(*second)
    return plane


def _textured(renderer: Any, plane: Any, picture: Array) -> None:
    """A plane with a picture (h, w, 3) of albedos on it."""
    height, width = picture.shape[:2]
    data = np.clip(255.0 * np.clip(picture, 0.0, 1.0) ** (1.0 / 2.2), 0, 255).astype(np.uint8)
    image = vtk.vtkImageData()
    image.SetDimensions(width, height, 1)
    image.GetPointData().SetScalars(numpy_to_vtk(data.reshape(-1, 3), deep=True))
    texture = vtk.vtkTexture()
    texture.SetInputData(image)
    texture.InterpolateOn()
    texture.MipmapOn()
    texture.UseSRGBColorSpaceOn()
    mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
    mapper.SetInputConnection(plane.GetOutputPort())
    actor.SetMapper(mapper)
    matt(actor)
    actor.GetProperty().SetBaseColorTexture(texture)
    renderer.AddActor(actor)


def _wall(rng: np.random.Generator) -> Array:
    """Plaster with framed pictures and a shelf of books."""
    height, width = 560, 900
    tone = rng.uniform(0.35, 0.6, 3) * [1.05, 1.0, 0.92]
    picture = np.ones((height, width, 3)) * tone.mean() * 0.6 + 0.4 * tone
    coarse = np.kron(rng.normal(0, 0.02, (height // 20, width // 20)), np.ones((20, 20)))
    picture += (coarse + rng.normal(0.0, 0.015, (height, width)))[..., None]
    for _ in range(7):
        w, h = rng.integers(60, 160, 2)
        x, y = rng.integers(0, width - w), rng.integers(0, height - h)
        base = rng.uniform(0.05, 0.6) * np.ones(3) + rng.uniform(-0.12, 0.12, 3)
        rows, columns = np.mgrid[0:h, 0:w]
        waves = np.sin(columns * rng.uniform(0.02, 0.2) + rows * rng.uniform(0.02, 0.2))
        inside = np.clip(base + 0.12 * waves[..., None] * rng.uniform(-1, 1, 3), 0.02, 0.9)
        picture[y : y + h, x : x + w] = 0.08
        picture[y + 5 : y + h - 5, x + 5 : x + w - 5] = inside[5:-5, 5:-5]
    x = 20
    while x < width - 30:
        w, h = int(rng.integers(8, 26)), int(rng.integers(70, 110))
        grey = rng.uniform(0.05, 0.5)
        picture[130 - min(h, 100) : 130, x : x + w] = np.clip(
            grey + rng.uniform(-0.15, 0.15, 3), 0.02, 0.8
        )
        x += w + int(rng.integers(1, 6))
    return picture


def _wood(rng: np.random.Generator) -> Array:
    rows, columns = np.mgrid[0:400, 0:600]
    grain = np.sin(rows * 0.35 + 2.5 * np.sin(columns * 0.013) + rng.uniform(0, 6))
    grain = grain + 0.5 * np.sin(rows * 1.3 + np.sin(columns * 0.03))
    base = np.array([0.32, 0.19, 0.10]) * rng.uniform(0.7, 1.3)
    return np.asarray(base * (1.0 + 0.12 * grain[..., None]) + rng.normal(0, 0.008, (400, 600, 1)))
