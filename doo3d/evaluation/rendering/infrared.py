"""Render the two infrared views of a stereo depth camera: surface texture, a projected dot pattern, blur and noise."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.random import Generator
from scipy.ndimage import gaussian_filter, map_coordinates

from ...types import Array, Bools, Camera, Floats
from .rays import OCCLUDER, SUBPIXELS, RayCaster, finer_rays, pixel_rays

AMBIENT, PATTERN, GREY_LEVEL = 0.55, 0.9, 90.0
"""Brightness of a white surface that faces the camera, brightness of a dot on it, and gray level (of 255) of the surface."""

MAX_GREY_LEVEL = 250.0
"""Gray level, of 255, of the brightest pixels: where a surface reflects so much light that the pattern disappears."""

TABLE_ALBEDO, SOLID_ALBEDO = 0.75, 0.85
"""Mean fractions of the infrared light that the table and the solid objects reflect."""

TABLE_CONTRAST, SOLID_CONTRAST = 0.10, 0.16
"""Standard deviation of the texture divided by its mean, of the table and of solid objects."""

TABLE_CELL, SOLID_CELL = 0.0012, 0.0009
"""Edge in m of a cell of the texture's noise: the weave of a cloth, the strands of a rope."""

PATCHES, PATCH_CELL = 0.6, 0.015
"""Variation of the texture's strength, for worn, dirty and glossy parts: standard deviation over mean, and cell edge in m."""

GLARE_CELL, GLARE_SHIFT, MIN_GLARE = 0.009, 17.3, 1.3
"""Noise that selects where cables mirror the light: edge of a cell in m, offset from the texture in cells, and threshold,
exceeded on some 3 % of the surface."""

TEXTURE_CELLS = 64
"""Cells along an edge of the cube of noise, which repeats."""

DOTS, DOT_SIGMA_PX = 5000, 0.9
"""Dots of the projector over 1280 x 720 px of an infrared camera, and their size; a D435 projects about 5000."""

PATTERN_MARGIN = 1.3
"""Size of the projected pattern, as a multiple of the infrared camera's view."""

FULL_WIDTH = 1280
"""Width in px of the infrared image that DOTS and DOT_SIGMA_PX refer to."""


@dataclass(frozen=True)
class InfraredLight:
    """The infrared texture of all surfaces, and the dot pattern that the projector casts on them.

    Attributes
    ----------
    texture
        (64, 64, 64) float32, noise of mean 0 and standard deviation 1 that fills space and repeats.
    pattern
        (H, W) float32, 0 to 1, the projected image; the projector is modelled as a camera.
    projector
        the intrinsics of the projector.
    position
        (3,) m, the center of the projector, in the optical frame of the color camera.
    """

    texture: Array
    pattern: Array
    projector: Camera
    position: Floats

    @classmethod
    def draw(cls, rng: Generator, camera: Camera, position: Floats) -> InfraredLight:
        """Draw a random texture and dot pattern.

        Parameters
        ----------
        rng
            the random number generator.
        camera
            the intrinsics of the infrared cameras, which the pattern covers with a margin.
        position
            (3,) m, the center of the projector, in the optical frame of the color camera.
        """
        texture = gaussian_filter(rng.normal(size=(TEXTURE_CELLS,) * 3), 0.6, mode="wrap")
        texture = (texture / texture.std()).astype(np.float32)
        width, height = (round(PATTERN_MARGIN * size) for size in (camera.width, camera.height))
        scale = min(1.0, max(camera.width / FULL_WIDTH, 0.25))
        spots = np.zeros((height, width), dtype=np.float32)
        count = round(DOTS * width * height / (FULL_WIDTH * FULL_WIDTH * 9 / 16) / scale**2)
        # one dot per cell of a jittered grid: dots neither meet nor leave large parts empty, as on the real projector
        cell = np.sqrt(width * height / count)
        y, x = np.mgrid[0 : int(height / cell), 0 : int(width / cell)].reshape(2, -1)
        jitter = rng.uniform(0.05, 0.95, (2, len(x)))
        row = np.minimum(((y + jitter[0]) * cell).astype(int), height - 1)
        column = np.minimum(((x + jitter[1]) * cell).astype(int), width - 1)
        spots[row, column] = rng.uniform(0.6, 1.0, len(x))
        pattern = gaussian_filter(spots, DOT_SIGMA_PX) * (2 * np.pi * DOT_SIGMA_PX**2)
        projector = Camera(camera.fx, camera.fy, (width - 1) / 2, (height - 1) / 2, width, height)
        return cls(texture, np.asarray(pattern, dtype=np.float32), projector, np.asarray(position, dtype=float))

    def brightness(self, points: Floats, normals: Floats, table: Bools, reference_depth: float) -> Floats:
        """Return the infrared brightness of surface points, (R,) float, 1 for a white surface facing the light without pattern.

        Parameters
        ----------
        points
            (R, 3) m, in the optical frame of the color camera.
        normals
            (R, 3) unit normals, of either sign.
        table
            (R,) bool, points of the table; the others are on solids.
        reference_depth
            depth in m at which the pattern has the brightness PATTERN; it falls with the square of the distance.
        """
        cell = np.where(table, TABLE_CELL, SOLID_CELL)
        noise = self._noise(points / cell[:, None])
        strength = np.clip(1 + PATCHES * self._noise(points / PATCH_CELL), 0.05, 2.0)
        mean, contrast = np.where(table, TABLE_ALBEDO, SOLID_ALBEDO), np.where(table, TABLE_CONTRAST, SOLID_CONTRAST)
        albedo = np.clip(mean * (1 + contrast * strength * noise), 0.02, 1.0)
        ray = points - self.position
        distance = np.linalg.norm(ray, axis=1)
        facing = np.abs(np.einsum("ij,ij->i", normals, ray)) / distance
        column, row = self.projector.project(ray).T
        dots = map_coordinates(self.pattern, (row, column), order=1)
        falloff = (reference_depth / np.maximum(distance, 0.1)) ** 2
        return np.asarray(albedo * (AMBIENT * (0.4 + 0.6 * facing) + PATTERN * dots * facing * falloff))

    def glares(self, points: Floats) -> Bools:
        """Return whether the surface at points (R, 3) m mirrors so much light that the pattern disappears: (R,) bool."""
        return np.asarray(self._noise(points / GLARE_CELL + GLARE_SHIFT) > MIN_GLARE)

    def _noise(self, cells: Floats) -> Floats:
        """Return the texture noise (R,) at points (R, 3), whose unit is a cell."""
        return np.asarray(map_coordinates(self.texture, cells.T, order=1, mode="grid-wrap"))


def infrared_view(
    caster: RayCaster, camera: Camera, origin: Floats, light: InfraredLight, reference_depth: float
) -> tuple[Floats, Bools]:
    """Render one infrared camera's view of a scene, without blur and noise.

    Parameters
    ----------
    caster
        the scene, in the optical frame of its color camera.
    camera
        the intrinsics of the infrared camera, whose axes are parallel to those of the color camera.
    origin
        (3,) m, the center of the infrared camera, in the optical frame of the color camera.
    light
        the texture and the pattern.
    reference_depth
        depth in m at which the pattern has its full brightness.

    Returns
    -------
    image : (H, W) float64 gray levels, 0 to 250; 0 where there is no surface.
    shiny : (H, W) bool, pixels of surfaces that the sensor cannot measure; they are so bright that no pattern shows.
    """
    directions = pixel_rays(camera)
    near = np.flatnonzero(_near_solids(caster, camera, origin))
    grey = _table_view(caster, directions, origin, light, reference_depth)
    shiny = np.zeros(len(grey), dtype=bool)
    if len(near):
        total = np.zeros(len(near))
        for finer in finer_rays(directions[near], camera):
            brightness, glaring = _hit_view(caster, finer, origin, light, reference_depth)
            total += brightness / SUBPIXELS
            shiny[near] |= glaring
        grey[near] = total
    grey = np.where(shiny, MAX_GREY_LEVEL, np.minimum(GREY_LEVEL * grey / AMBIENT, MAX_GREY_LEVEL))
    shape = (camera.height, camera.width)
    return grey.reshape(shape), shiny.reshape(shape)


def expose(image: Floats, blur: float, noise: float, rng: Generator) -> Array:
    """Add the blur of the lens and the noise of the image sensor to a view: (H, W) uint8.

    Parameters
    ----------
    image
        (H, W) gray levels, from `infrared_view`.
    blur
        sigma of the blur, px.
    noise
        standard deviation of the noise, gray levels.
    rng
        the random number generator of the noise.
    """
    soft = gaussian_filter(image, blur)
    return np.asarray(np.clip(soft + rng.normal(0, noise, image.shape) + 0.5, 0, 255), dtype=np.uint8)


def _hit_view(
    caster: RayCaster, directions: Floats, origin: Floats, light: InfraredLight, reference_depth: float
) -> tuple[Floats, Bools]:
    """Return the brightness (R,) at the first hit of each ray, and whether it is a shiny stretch of cable, (R,) bool."""
    hits = caster.cast(np.broadcast_to(origin, directions.shape), directions)
    found = np.flatnonzero(np.isfinite(hits.depth))
    points = origin + hits.depth[found, None] * directions[found]
    result = np.zeros(len(directions))
    result[found] = light.brightness(points, hits.normals[found], hits.solid[found] < 0, reference_depth)
    shiny = hits.shiny.copy()
    shiny[found] |= ((hits.label[found] > 0) & (hits.label[found] < OCCLUDER)) & light.glares(points)
    return result, shiny


def _table_view(caster: RayCaster, directions: Floats, origin: Floats, light: InfraredLight, reference_depth: float) -> Floats:
    """Return the brightness (R,) of the table along each ray, as if there were no solids; 0 without a table."""
    table, result = caster.scene.table, np.zeros(len(directions))
    if table is None:
        return result
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = ((table.point - origin) @ table.normal) / (directions @ table.normal)
    on = np.flatnonzero(np.isfinite(depth) & (depth > 0))
    points = origin + depth[on, None] * directions[on]
    normals = np.broadcast_to(table.normal, points.shape)
    result[on] = light.brightness(points, normals, np.ones(len(on), dtype=bool), reference_depth)
    return result


def _near_solids(caster: RayCaster, camera: Camera, origin: Floats) -> Array:
    """Return which pixels' rays may hit a cable or another solid, (H * W,) bool."""
    canvas = np.zeros((camera.height, camera.width), dtype=np.uint8)
    for cable in caster.scene.cables:
        points = cable.axis[::4] - origin
        depth = points[:, 2].min() - cable.radius
        if depth <= 0:
            return np.ones(canvas.size, dtype=bool)
        width = int(np.ceil(2.2 * cable.radius * camera.fx / depth)) + 4
        line = np.round(np.clip(camera.project(points), -1e4, 1e4)).astype(np.int32)
        cv2.polylines(canvas, [line], cable.closed, 1, width)
    for solid in caster.scene.occluders:
        points = solid.vertices - origin
        if points[:, 2].max() <= 0:
            continue
        if points[:, 2].min() <= 0:
            return np.ones(canvas.size, dtype=bool)
        corners = np.round(np.clip(camera.project(points), -1e4, 1e4)).astype(np.int32)
        hull = cv2.convexHull(corners)
        cv2.fillConvexPoly(canvas, hull, 1)
        cv2.polylines(canvas, [hull], True, 1, 5)
    return canvas.reshape(-1) > 0
