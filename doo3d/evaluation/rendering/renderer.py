"""Render a scene with a simulated depth camera: color, depth, and the label of each pixel."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.ndimage import binary_dilation, gaussian_filter, zoom

from ...types import Array, Bools, Floats, Frame
from ..scenes.model import Scene, Truth
from ..scenes.registry import family_rng
from .depth_sensor import SENSORS, measure_depth
from .rays import OCCLUDER, SUBPIXELS, TABLE, Hits, RayCaster, finer_rays, pixel_rays
from .stereo import STEREO_SENSORS, measure_stereo

AMBIENT, DIFFUSE, GLOSS = 0.42, 0.62, 0.10
"""Fractions of ambient, diffuse and specular light; in shadow, only the ambient part is left."""

MIN_WALL_LENGTH = 0.4
"""Length in m from which on a solid counts as a wall or table top, whose slope is no depth edge; grippers and plugs are
shorter."""

COLOR_NOISE = 1.6
"""Standard deviation of the color sensor's noise, in gray levels of 255."""


@dataclass(frozen=True)
class Rendered:
    """A rendered frame with its truth.

    Attributes
    ----------
    frame
        color and depth, with the errors of the sensor.
    labels
        (H, W) uint8: i at the pixels of cable i, from 1; 0 for table and background; 255 for other solids.
    mask
        (H, W) bool, the pixels of all cables.
    truths
        the cables in the camera's optical frame, with `seen` filled in.
    exact
        (H, W) float64 m, the depth without the errors of the sensor; 0 where there is no surface.
    """

    frame: Frame
    labels: Array
    mask: Bools
    truths: tuple[Truth, ...]
    exact: Floats


def render(scene: Scene, sensor: str = "d435") -> Rendered:
    """Render the frame that a depth camera takes of a scene; the same arguments give the same frame.

    Parameters
    ----------
    scene
        the scene, in the optical frame of its camera.
    sensor
        simulated depth camera: "d435", "d455", "zivid", "stereo", "coarse", or "none" for exact depth. "stereo" and "coarse"
        match two rendered infrared images; the others add errors to the exact depth.

    Raises
    ------
    ValueError : there is no such sensor.
    MissingDependency : open3d is not installed.
    """
    if sensor not in SENSORS | STEREO_SENSORS:
        raise ValueError(f"no sensor {sensor!r}: there are {', '.join([*SENSORS, *STEREO_SENSORS])}")
    rng = family_rng(f"{scene.family}/{scene.name}/{sensor}", scene.seed)
    caster, camera = RayCaster(scene), scene.camera
    shape = (camera.height, camera.width)
    directions = pixel_rays(camera)
    hits = caster.cast(np.zeros_like(directions), directions)
    exact = np.where(np.isfinite(hits.depth), hits.depth, 0.0).reshape(shape)
    labels = hits.label.reshape(shape)
    color = _color_image(caster, hits, directions, rng)
    if sensor in STEREO_SENSORS:
        depth = measure_stereo(caster, STEREO_SENSORS[sensor], rng)
    else:
        depth = measure_depth(exact, hits.shiny.reshape(shape), camera, SENSORS[sensor], rng, _walls(scene, hits).reshape(shape))
    truths = tuple(replace(cable, seen=caster.seen_samples(cable)) for cable in scene.cables)
    frame = Frame(color=color, depth=depth, camera=camera, name=scene.name)
    return Rendered(frame, labels, (labels > 0) & (labels < OCCLUDER), truths, exact)


def _walls(scene: Scene, hits: Hits) -> Array:
    """Return the number, from 1, of the table or large solid that each ray hits, (R,) int; 0 for other hits."""
    wide = [bool(np.ptp(solid.vertices, axis=0).max() > MIN_WALL_LENGTH) for solid in scene.occluders]
    number = np.zeros(len(scene.cables) + len(wide) + 2, dtype=np.int64)
    number[len(scene.cables) : len(scene.cables) + len(wide)] = np.where(wide, np.arange(len(wide)) + 2, 0)
    number[TABLE] = 1
    return number[hits.solid]


def _color_image(caster: RayCaster, hits: Hits, directions: Floats, rng: Generator) -> Array:
    """Return the shaded image, (H, W, 3) uint8, with four rays per pixel wherever a solid is near."""
    scene = caster.scene
    shape = (scene.camera.height, scene.camera.width)
    table = _table_light(caster, directions).reshape(-1, 1)
    if scene.table is None or scene.table.cloth is None:
        table = table * _texture(shape, rng).reshape(-1, 1)
    image = _shade(caster, hits, directions, table)
    solid = hits.solid.reshape(shape) >= 0
    near = np.flatnonzero(binary_dilation(solid, iterations=2))
    means = np.zeros((len(near), 3))
    for finer in finer_rays(directions[near], scene.camera):
        means += _shade(caster, caster.cast(np.zeros_like(finer), finer), finer, table[near]) / SUBPIXELS
    image[near] = means
    noisy = gaussian_filter(image.reshape(*shape, 3), (0.45, 0.45, 0)) + rng.normal(0, COLOR_NOISE, (*shape, 3))
    return np.asarray(np.clip(noisy + 0.5, 0, 255), dtype=np.uint8)


def _shade(caster: RayCaster, hits: Hits, directions: Floats, table: Floats) -> Floats:
    """Return the colors of the hits of rays from the camera, (R, 3), 0 to 255.

    Parameters
    ----------
    caster, hits, directions
        the scene, the hits, and the rays (R, 3).
    table
        (R, 1), brightness of the table along each ray.
    """
    scene = caster.scene
    solids = [cable.color for cable in scene.cables] + [solid.color for solid in scene.occluders]
    colors = np.array(solids, dtype=float).reshape(-1, 3)
    result = np.tile(np.array(scene.background, dtype=float), (len(directions), 1))
    if scene.table is not None:
        on_table = hits.solid == TABLE
        result[on_table] = table[on_table] * np.array(scene.table.color, dtype=float)
        for pattern in (scene.table.grain, scene.table.cloth):
            if pattern is not None:
                result[on_table] *= pattern.brightness(hits.depth[on_table, None] * directions[on_table])[:, None]
    on = np.flatnonzero(hits.solid >= 0)
    normals, ray = hits.normals[on], directions[on]
    normals = np.where((np.einsum("ij,ij->i", normals, ray) > 0)[:, None], -normals, normals)
    lit = ~caster.in_shadow(hits.depth[on, None] * ray, normals)
    light = np.array(scene.light)
    halfway = light - ray / np.linalg.norm(ray, axis=1, keepdims=True)
    halfway /= np.linalg.norm(halfway, axis=1, keepdims=True)
    diffuse = np.clip(normals @ light, 0, 1) * lit
    gloss = np.clip(np.einsum("ij,ij->i", normals, halfway), 0, 1) ** 40 * lit
    base = colors[hits.solid[on]]
    for k, cable in enumerate(scene.cables):
        if cable.stripe is not None:
            base[(hits.solid[on] == k) & hits.striped[on]] = cable.stripe.color
    grains = [None] * len(scene.cables) + [solid.grain for solid in scene.occluders]
    for grain in {id(each): each for each in grains if each is not None}.values():
        part = np.flatnonzero(np.array([each is grain for each in grains])[hits.solid[on]])
        base[part] *= grain.brightness(hits.depth[on[part], None] * ray[part])[:, None]
    result[on] = base * (AMBIENT + DIFFUSE * diffuse)[:, None] + 255 * GLOSS * gloss[:, None]
    return result


def _table_light(caster: RayCaster, directions: Floats) -> Floats:
    """Return the brightness of the table where each ray meets it, with soft shadows, (R,)."""
    scene = caster.scene
    if scene.table is None:
        return np.ones(len(directions))
    depth = (scene.table.point @ scene.table.normal) / (directions @ scene.table.normal)
    normals = np.broadcast_to(scene.table.normal, directions.shape)
    dark = caster.in_shadow(depth[:, None] * directions, normals).astype(float)
    dark = gaussian_filter(dark.reshape(scene.camera.height, scene.camera.width), 2.0).reshape(-1)
    return np.asarray(
        AMBIENT + 0.16 * (1 - dark) + (DIFFUSE - 0.16) * (scene.table.normal @ np.asarray(scene.light)) * (1 - 0.8 * dark)
    )


def _texture(shape: tuple[int, int], rng: Generator) -> Floats:
    """Return a texture (H, W) of mean 1: cloudy at several scales, with a grain along one direction."""
    height, width = shape
    result = np.ones(shape)
    for cells, strength in ((6, 0.05), (40, 0.025), (160, 0.015)):
        coarse = rng.normal(0, strength, (height * cells // width + 3, cells + 3))
        result += zoom(coarse, width / cells, order=1)[:height, :width]
    return np.asarray(result + gaussian_filter(rng.normal(0, 0.16, shape), (0.6, 9.0)))
