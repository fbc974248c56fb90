"""A scene as a depth camera sees it: colour, depth, and which pixel is what."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.ndimage import binary_dilation, gaussian_filter, zoom

from ...types import Array, Bools, Camera, Floats, Frame
from ..scenes.model import Scene, Truth
from ..scenes.registry import family_rng
from .depth_sensor import SENSORS, measured
from .rays import OCCLUDER, Hits, Rays

AMBIENT, DIFFUSE, GLOSS = 0.42, 0.62, 0.10  # shares of the light; the table's shadow keeps the ambient part
SUBPIXELS = np.array([(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)])
COLOR_NOISE = 1.6  # grey levels of 255, of the colour sensor


@dataclass(frozen=True)
class Rendered:
    """A frame and its truth.

    frame : colour and depth. labels : (H, W) uint8, 0 background, i = cable i, 255 = anything else. mask : (H, W) bool,
    the pixels of cables. truths : the cables with `seen` filled in. exact : (H, W) float64 m, the depth before the sensor.
    """

    frame: Frame
    labels: Array
    mask: Bools
    truths: tuple[Truth, ...]
    exact: Floats


def render(scene: Scene, sensor: str = "d435") -> Rendered:
    """The frame that a sensor (a key of SENSORS) takes of the scene; the same every time.

    Raises
    ------
    ValueError : no such sensor.
    MissingDependency : open3d is not installed.
    """
    if sensor not in SENSORS:
        raise ValueError(f"no sensor {sensor!r}: there are {', '.join(SENSORS)}")
    rng = family_rng(f"{scene.family}/{scene.name}/{sensor}", scene.seed)
    rays, camera = Rays(scene), scene.camera
    shape = (camera.height, camera.width)
    directions = pixel_rays(camera)
    hits = rays.cast(np.zeros_like(directions), directions)
    exact = np.where(np.isfinite(hits.depth), hits.depth, 0.0).reshape(shape)
    labels = hits.label.reshape(shape)
    color = _colored(rays, hits, directions, rng)
    depth = measured(exact, hits.shiny.reshape(shape), camera, SENSORS[sensor], rng)
    truths = tuple(replace(cable, seen=rays.seen(cable)) for cable in scene.cables)
    frame = Frame(color=color, depth=depth, camera=camera, name=scene.name)
    return Rendered(frame, labels, (labels > 0) & (labels < OCCLUDER), truths, exact)


def pixel_rays(camera: Camera, shift: tuple[float, float] = (0.0, 0.0)) -> Floats:
    """(H * W, 3) directions with z = 1 through the pixel centres, moved by `shift` px; depth along them is z."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width].reshape(2, -1).astype(float)
    return camera.unproject(np.column_stack((u + shift[0], v + shift[1])), np.ones(len(u)))


def _colored(rays: Rays, hits: Hits, directions: Floats, rng: Generator) -> Array:
    """(H, W, 3) uint8: shaded, with four rays to a pixel wherever something other than the table is near."""
    scene = rays.scene
    shape = (scene.camera.height, scene.camera.width)
    table = _table_light(rays, directions).reshape(-1, 1) * _texture(shape, rng).reshape(-1, 1)
    image = _shaded(rays, hits, directions, table)
    solid = hits.solid.reshape(shape) >= 0
    near = np.flatnonzero(binary_dilation(solid, iterations=2))
    parts = np.zeros((len(near), 3))
    for shift in SUBPIXELS:
        finer = directions[near] + np.append(shift / (scene.camera.fx, scene.camera.fy), 0.0)
        parts += _shaded(rays, rays.cast(np.zeros_like(finer), finer), finer, table[near]) / len(SUBPIXELS)
    image[near] = parts
    noisy = gaussian_filter(image.reshape(*shape, 3), (0.45, 0.45, 0)) + rng.normal(0, COLOR_NOISE, (*shape, 3))
    return np.asarray(np.clip(noisy + 0.5, 0, 255), dtype=np.uint8)


def _shaded(rays: Rays, hits: Hits, directions: Floats, table: Floats) -> Floats:
    """(R, 3) colours 0 to 255 of what rays from the camera met; `table` (R, 1) is the table's brightness there."""
    scene = rays.scene
    colors = np.array([cable.color for cable in scene.cables] + [solid.color for solid in scene.occluders], dtype=float)
    result = np.tile(np.array(scene.background, dtype=float), (len(directions), 1))
    if scene.table is not None:
        flat = hits.solid == -1
        result[flat] = table[flat] * np.array(scene.table.color, dtype=float)
    on = np.flatnonzero(hits.solid >= 0)
    normals, ray = hits.normals[on], directions[on]
    normals = np.where((np.einsum("ij,ij->i", normals, ray) > 0)[:, None], -normals, normals)
    lit = ~rays.shadowed(hits.depth[on, None] * ray, normals)
    light = np.array(scene.light)
    half = light - ray / np.linalg.norm(ray, axis=1, keepdims=True)
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    diffuse = np.clip(normals @ light, 0, 1) * lit
    gloss = np.clip(np.einsum("ij,ij->i", normals, half), 0, 1) ** 40 * lit
    result[on] = colors[hits.solid[on]] * (AMBIENT + DIFFUSE * diffuse)[:, None] + 255 * GLOSS * gloss[:, None]
    return result


def _table_light(rays: Rays, directions: Floats) -> Floats:
    """(R,) brightness of the table where each ray meets it, with soft shadows."""
    scene = rays.scene
    if scene.table is None:
        return np.ones(len(directions))
    depth = (scene.table.point @ scene.table.normal) / (directions @ scene.table.normal)
    normals = np.broadcast_to(scene.table.normal, directions.shape)
    dark = rays.shadowed(depth[:, None] * directions, normals).astype(float)
    dark = gaussian_filter(dark.reshape(scene.camera.height, scene.camera.width), 2.0).reshape(-1)
    return np.asarray(
        AMBIENT + 0.16 * (1 - dark) + (DIFFUSE - 0.16) * (scene.table.normal @ np.asarray(scene.light)) * (1 - 0.8 * dark)
    )


def _texture(shape: tuple[int, int], rng: Generator) -> Floats:
    """(H, W) about 1: cloudy at several scales, with a grain along one direction."""
    height, width = shape
    result = np.ones(shape)
    for cells, strength in ((6, 0.05), (40, 0.025), (160, 0.015)):
        coarse = rng.normal(0, strength, (height * cells // width + 3, cells + 3))
        result += zoom(coarse, width / cells, order=1)[:height, :width]
    return np.asarray(result + gaussian_filter(rng.normal(0, 0.16, shape), (0.6, 9.0)))
