"""Rays against a scene: what they hit first, where, and which samples of the true axes the camera sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...inputs.support.open3d import open3d
from ...types import Array, Bools, Floats, Ints
from ..scenes.model import Scene, Truth
from .tube_mesh import frames, sweep, tangents

OCCLUDER = 255  # the label of everything that is neither cable nor background
GRAZE = 0.2  # radii that a ray may stop short of the point it was sent to and still see it
ROUND = np.radians((-60.0, -30.0, 0.0, 30.0, 60.0))  # where round the visible half of a cable rays are sent
CHUNK = 1_000_000  # rays at once


@dataclass(frozen=True)
class Hits:
    """What each of R rays met. depth : (R,) along the ray, inf = nothing. label : (R,) uint8, 0 = table or nothing.

    normals : (R, 3) unit, smooth on cables. solid : (R,) int, which cable or occluder, -1 = table, -2 = nothing.
    shiny : (R,) bool.
    """

    depth: Floats
    label: Array
    normals: Floats
    solid: Ints
    shiny: Bools


class Rays:
    """A scene made ready for ray casting; cables come first, then occluders."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.tubes = [sweep(cable) for cable in scene.cables]
        self._caster = open3d().t.geometry.RaycastingScene()
        meshes = [(tube.vertices, tube.triangles) for tube in self.tubes]
        meshes += [(solid.vertices, solid.triangles) for solid in scene.occluders]
        for vertices, triangles in meshes:
            self._caster.add_triangles(_tensor(vertices.astype(np.float32)), _tensor(triangles.astype(np.uint32)))

    def cast(self, origins: Floats, directions: Floats) -> Hits:
        """What rays from origins (R, 3) m along directions (R, 3) meet first; depth is in units of the direction."""
        parts = [self._cast(origins[k : k + CHUNK], directions[k : k + CHUNK]) for k in range(0, len(origins), CHUNK)]
        return Hits(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])))

    def _cast(self, origins: Floats, directions: Floats) -> Hits:
        answer = self._caster.cast_rays(_tensor(np.hstack((origins, directions)).astype(np.float32)))
        depth = answer["t_hit"].numpy().astype(float)
        solid = answer["geometry_ids"].numpy().astype(np.int64)
        normals = answer["primitive_normals"].numpy().astype(float)
        triangle, uv = answer["primitive_ids"].numpy().astype(np.int64), answer["primitive_uvs"].numpy().astype(float)
        solid[~np.isfinite(depth)] = -2
        label = np.where(solid >= 0, OCCLUDER, 0).astype(np.uint8)
        shiny = np.zeros(len(depth), dtype=bool)
        for k, (tube, cable) in enumerate(zip(self.tubes, self.scene.cables, strict=True)):
            on = np.flatnonzero(solid == k)
            label[on] = k + 1
            corners = tube.normals[tube.triangles[triangle[on]]]
            weights = np.column_stack((1 - uv[on].sum(axis=1), uv[on]))
            normals[on] = np.einsum("ij,ijk->ik", weights, corners)
            arcs = tube.arcs[triangle[on]]
            for start, end in cable.shiny:
                shiny[on] |= (arcs >= start) & (arcs <= end)
        self._add_table(origins, directions, depth, label, normals, solid)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        return Hits(depth, label, normals, solid, shiny & (solid >= 0))

    def _add_table(self, origins: Floats, directions: Floats, depth: Floats, label: Array, normals: Floats, solid: Ints) -> None:
        table = self.scene.table
        if table is None:
            return
        with np.errstate(divide="ignore", invalid="ignore"):
            to_table = ((table.point - origins) @ table.normal) / (directions @ table.normal)
        nearer = (to_table > 0) & (to_table < depth)
        depth[nearer], label[nearer], solid[nearer] = to_table[nearer], 0, -1
        normals[nearer] = table.normal

    def shadowed(self, points: Floats, normals: Floats) -> Bools:
        """(R,) bool: a solid stands between the point (R, 3) m on a surface and the light."""
        light = np.broadcast_to(np.asarray(self.scene.light), points.shape)
        rays = np.hstack((points + 2e-4 * normals, light)).astype(np.float32)
        parts = [self._caster.test_occlusions(_tensor(rays[k : k + CHUNK])).numpy() for k in range(0, len(rays), CHUNK)]
        return np.concatenate(parts)

    def seen(self, cable: Truth) -> Bools:
        """(P,) bool: the camera sees the surface of the cable at each axis sample, in the image.

        Rays go to points round the half that faces the camera; most of them have to arrive.
        """
        pair = frames(cable.axis, tangents(cable.axis, cable.closed))
        view = cable.axis / np.linalg.norm(cable.axis, axis=1, keepdims=True)
        facing = -np.einsum("pij,pj->pi", pair, view)
        middle = np.arctan2(facing[:, 1], facing[:, 0])
        angle = middle[:, None] + ROUND
        circle = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        targets = cable.axis[:, None] + cable.radius * (circle @ pair)
        flat = targets.reshape(-1, 3)
        reach = np.linalg.norm(flat, axis=1)
        hits = self.cast(np.zeros_like(flat), flat / reach[:, None])
        arrived = (hits.depth > reach - GRAZE * cable.radius).reshape(len(cable.axis), -1)
        pixels = self.scene.camera.project(cable.axis)
        camera = self.scene.camera
        inside = ((pixels >= -0.5) & (pixels < np.array([camera.width, camera.height]) - 0.5)).all(axis=1)
        return np.asarray((arrived.mean(axis=1) > 0.5) & inside)


def _tensor(array: Array) -> Any:
    return open3d().core.Tensor.from_numpy(np.ascontiguousarray(array))
