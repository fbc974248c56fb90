"""Cast rays into a scene, to find their first hits and the samples of the true axes that the camera sees."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...inputs.support.open3d import open3d
from ...types import Array, Bools, Camera, Floats, Ints
from ..scenes.model import Scene, Truth
from .tube_mesh import SIDES, parallel_frames, sweep, tangents

OCCLUDER = 255
"""Label of pixels of solids that are not cables."""

TABLE, NOTHING = -1, -2
"""Values of `Hits.solid` for rays that hit the table, and for rays that hit nothing."""

MAX_SHORTFALL_RADII = 0.2
"""Greatest distance, in radii, between the end of a ray and its target at which the target counts as seen."""

TARGET_ANGLES = np.radians((-60.0, -30.0, 0.0, 30.0, 60.0))
"""Angles in radians, around the visible half of a cable, of the surface points that rays are cast to."""

SHADOW_OFFSET = 2e-4
"""Distance in m from the surface at which shadow rays start, so that they do not hit the surface itself."""

RAYS_AT_ONCE = 1_000_000
"""Greatest number of rays that are cast at once, to bound the memory."""

SUBPIXELS = 4
"""Number of rays per pixel near a solid."""


def pixel_rays(camera: Camera) -> Floats:
    """Return the direction of the ray through the center of each pixel, (H * W, 3), row by row, in the camera's optical frame.

    Directions have z = 1, so that t times a direction is the point at depth t.
    """
    v, u = np.mgrid[0 : camera.height, 0 : camera.width].reshape(2, -1).astype(float)
    return camera.unproject(np.column_stack((u, v)), np.ones(len(u)))


def finer_rays(directions: Floats, camera: Camera) -> Iterator[Floats]:
    """Yield, for each of the SUBPIXELS parts of a pixel, the directions (R, 3) through it instead of the pixel's center."""
    for v, u in ((-0.25, -0.25), (-0.25, 0.25), (0.25, -0.25), (0.25, 0.25)):
        yield directions + np.array([u / camera.fx, v / camera.fy, 0.0])


@dataclass(frozen=True)
class Hits:
    """The first hits of R rays.

    Attributes
    ----------
    depth
        (R,) factor t of the direction: the hit is at origin + t * direction; inf if nothing is hit.
    label
        (R,) uint8: i for cable i, from 1; 255 for another solid; 0 for the table or nothing.
    normals
        (R, 3) unit normals of the surface; on cables, interpolated between the vertices of the mesh.
    solid
        (R,) int, index of the solid that is hit: cables from 0, then occluders; -1 for the table, -2 for nothing.
    shiny
        (R,) bool, whether the hit is on a stretch of cable where the sensor measures no depth.
    striped
        (R,) bool, whether the hit is on a stripe of a cable.
    """

    depth: Floats
    label: Array
    normals: Floats
    solid: Ints
    shiny: Bools
    striped: Bools


class RayCaster:
    """A scene prepared for ray casting, in the optical frame of its camera (x right, y down, z forward).

    Parameters
    ----------
    scene
        the scene; its cables become tubes of triangles.

    Attributes
    ----------
    scene
        the scene.
    tubes
        the surface of each cable.

    Raises
    ------
    MissingDependency : open3d is not installed.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.tubes = [sweep(cable) for cable in scene.cables]
        self._caster = open3d().t.geometry.RaycastingScene()
        meshes = [(tube.vertices, tube.triangles) for tube in self.tubes]
        meshes += [(solid.vertices, solid.triangles) for solid in scene.occluders]
        for vertices, triangles in meshes:
            self._caster.add_triangles(_tensor(vertices.astype(np.float32)), _tensor(triangles.astype(np.uint32)))

    def cast(self, origins: Floats, directions: Floats) -> Hits:
        """Return the first hit of each of R rays.

        Parameters
        ----------
        origins
            (R, 3) m, in the camera's optical frame.
        directions
            (R, 3), of any length; the depth of a hit is in units of this length. So for rays from the camera whose direction has
            z = 1, it is the depth in m.
        """
        parts = [
            self._cast(origins[k : k + RAYS_AT_ONCE], directions[k : k + RAYS_AT_ONCE])
            for k in range(0, max(len(origins), 1), RAYS_AT_ONCE)
        ]
        return Hits(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])))

    def _cast(self, origins: Floats, directions: Floats) -> Hits:
        answer = self._caster.cast_rays(_tensor(np.hstack((origins, directions)).astype(np.float32)))
        depth = answer["t_hit"].numpy().astype(float)
        solid = answer["geometry_ids"].numpy().astype(np.int64)
        normals = answer["primitive_normals"].numpy().astype(float)
        triangle, uv = answer["primitive_ids"].numpy().astype(np.int64), answer["primitive_uvs"].numpy().astype(float)
        solid[~np.isfinite(depth)] = NOTHING
        label = np.where(solid >= 0, OCCLUDER, 0).astype(np.uint8)
        shiny, striped = np.zeros((2, len(depth)), dtype=bool)
        for k, (tube, cable) in enumerate(zip(self.tubes, self.scene.cables, strict=True)):
            on = np.flatnonzero(solid == k)
            label[on] = k + 1
            corners = tube.normals[tube.triangles[triangle[on]]]
            weights = np.column_stack((1 - uv[on].sum(axis=1), uv[on]))
            normals[on] = np.einsum("ij,ijk->ik", weights, corners)
            arcs = tube.arcs[triangle[on]]
            for start, end in cable.shiny:
                shiny[on] |= (arcs >= start) & (arcs <= end)
            if cable.stripe is not None:
                turn = triangle[on] // 2 % SIDES / SIDES
                striped[on] = (arcs / cable.stripe.pitch + cable.stripe.threads * turn) % 1 < cable.stripe.share
        self._add_table(origins, directions, depth, label, normals, solid)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        return Hits(depth, label, normals, solid, shiny & (solid >= 0), striped & (solid >= 0))

    def _add_table(self, origins: Floats, directions: Floats, depth: Floats, label: Array, normals: Floats, solid: Ints) -> None:
        table = self.scene.table
        if table is None:
            return
        with np.errstate(divide="ignore", invalid="ignore"):
            to_table = ((table.point - origins) @ table.normal) / (directions @ table.normal)
        nearer = (to_table > 0) & (to_table < depth)
        depth[nearer], label[nearer], solid[nearer] = to_table[nearer], 0, TABLE
        normals[nearer] = table.normal

    def in_shadow(self, points: Floats, normals: Floats) -> Bools:
        """Return which of R points on surfaces are in shadow, (R,) bool: those with a solid between point and light.

        Parameters
        ----------
        points
            (R, 3) m, in the camera's optical frame.
        normals
            (R, 3) unit vectors, away from the surface.
        """
        light = np.broadcast_to(np.asarray(self.scene.light), points.shape)
        rays = np.hstack((points + SHADOW_OFFSET * normals, light)).astype(np.float32)
        firsts = range(0, max(len(rays), 1), RAYS_AT_ONCE)
        return np.concatenate([self._caster.test_occlusions(_tensor(rays[k : k + RAYS_AT_ONCE])).numpy() for k in firsts])

    def seen_samples(self, cable: Truth) -> Bools:
        """Return at which of its P axis points the camera sees a cable's surface, (P,) bool.

        A point counts as seen if it is in the image, and if at least three of five points across the half of the surface that
        faces the camera are not hidden.

        Parameters
        ----------
        cable
            the cable, in the camera's optical frame.
        """
        normals = parallel_frames(cable.axis, tangents(cable.axis, cable.closed))
        view = cable.axis / np.linalg.norm(cable.axis, axis=1, keepdims=True)
        facing = -np.einsum("pij,pj->pi", normals, view)
        middle = np.arctan2(facing[:, 1], facing[:, 0])
        angle = middle[:, None] + TARGET_ANGLES
        circle = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        targets = cable.axis[:, None] + cable.radius * (circle @ normals)
        targets = targets.reshape(-1, 3)
        distance = np.linalg.norm(targets, axis=1)
        hits = self.cast(np.zeros_like(targets), targets / distance[:, None])
        arrived = (hits.depth > distance - MAX_SHORTFALL_RADII * cable.radius).reshape(len(cable.axis), -1)
        pixels = self.scene.camera.project(cable.axis)
        camera = self.scene.camera
        inside = ((pixels >= -0.5) & (pixels < np.array([camera.width, camera.height]) - 0.5)).all(axis=1)
        return np.asarray((arrived.mean(axis=1) > 0.5) & inside)


def _tensor(array: Array) -> Any:
    return open3d().core.Tensor.from_numpy(np.ascontiguousarray(array))
