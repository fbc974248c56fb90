"""Build triangle meshes of cables: tubes swept along an axis without twist, with half spheres at the tips."""

from dataclasses import dataclass

import numpy as np

from ...types import Floats, Ints
from ..scenes.model import Truth

SIDES = 32
"""Number of sides of a ring; their middles are 0.5 % of the radius inside the true surface."""

CAP_RINGS = 5
"""Number of rings of a half sphere."""

AXIS_STRIDE = 2
"""Number of axis points from ring to ring, which is 1 mm."""


@dataclass(frozen=True)
class Tube:
    """The surface of a cable as a triangle mesh of V vertices and T triangles.

    Attributes
    ----------
    vertices
        (V, 3) m, in the frame of the cable.
    normals
        (V, 3) unit normals at the vertices, outwards.
    triangles
        (T, 3) int, indices of vertices; `normals`, not the order of the indices, give the outer side.
    arcs
        (T,) m, arc length along the cable's axis at each triangle.
    """

    vertices: Floats
    normals: Floats
    triangles: Ints
    arcs: Floats


def tangents(points: Floats, closed: bool = False) -> Floats:
    """Return the unit tangent at each of P points of a polyline, (P, 3), by central differences (one-sided at the ends).

    Parameters
    ----------
    points
        (P, 3) m; at least two.
    closed
        whether the polyline is a ring, whose first point follows the last and is not repeated.
    """
    if closed:
        difference = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    else:
        difference = np.asarray(np.gradient(points, axis=0))
    return np.asarray(difference / np.linalg.norm(difference, axis=1, keepdims=True))


def parallel_frames(points: Floats, tangent: Floats) -> Floats:
    """Return two unit normals at each of P points of a polyline, (P, 2, 3), which twist as little as possible along it.

    The two normals are orthogonal to the tangent and to each other.

    Parameters
    ----------
    points
        (P, 3) m; no two successive points may be the same.
    tangent
        (P, 3) unit tangents at the points.

    Notes
    -----
    These are rotation-minimizing frames by the double reflection of Wang, Juettler, Zheng and Liu, "Computation of Rotation
    Minimizing Frames" (2008).
    """
    result = np.empty((len(points), 2, 3))
    result[0] = np.linalg.svd(tangent[:1])[2][1:]
    for k in range(len(points) - 1):
        v = points[k + 1] - points[k]
        normals = result[k] - np.outer(2 * (result[k] @ v) / (v @ v), v)
        reflected = tangent[k] - 2 * (tangent[k] @ v) / (v @ v) * v
        w = tangent[k + 1] - reflected
        size = w @ w
        result[k + 1] = normals - np.outer(2 * (normals @ w) / size, w) if size > 1e-18 else normals
    return result


def sweep(cable: Truth) -> Tube:
    """Return the surface of a cable as a triangle mesh: a tube round its axis, closed by half spheres if the cable is open."""
    if cable.closed:
        points, arcs = cable.axis[::AXIS_STRIDE], cable.arcs[::AXIS_STRIDE]
    else:
        index = np.unique(np.append(np.arange(0, len(cable.axis), AXIS_STRIDE), len(cable.axis) - 1))
        points, arcs = cable.axis[index], cable.arcs[index]
    tangent = tangents(points, cable.closed)
    pair = parallel_frames(points, tangent)
    radii, slope, centers = np.ones(len(points)), np.zeros(len(points)), points
    if not cable.closed:
        bend = np.linspace(np.pi / 2 - 1e-3, 0, CAP_RINGS, endpoint=False)
        radii = np.concatenate((np.cos(bend), radii, np.cos(bend[::-1])))
        slope = np.concatenate((-np.sin(bend), slope, np.sin(bend[::-1])))
        padding = ((CAP_RINGS, CAP_RINGS), (0, 0))
        centers, tangent = np.pad(points, padding, "edge"), np.pad(tangent, padding, "edge")
        pair = np.pad(pair, (*padding, (0, 0)), "edge")
        arcs = np.pad(arcs, CAP_RINGS, "edge")
    angle = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    normals = radii[:, None, None] * (circle @ pair) + slope[:, None, None] * tangent[:, None]
    vertices = centers[:, None] + cable.radius * normals
    triangles = _ring_triangles(len(centers), cable.closed)
    return Tube(vertices.reshape(-1, 3), normals.reshape(-1, 3), triangles, np.repeat(arcs, 2 * SIDES)[: len(triangles)])


def _ring_triangles(rings: int, closed: bool) -> Ints:
    """Return the triangles (T, 3) between successive rings, two per side; the tiny holes at the poles stay open."""
    ring = np.arange(rings if closed else rings - 1)[:, None]
    side = np.arange(SIDES)[None, :]
    following = (ring + 1) % rings
    a, b = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
    c, d = following * SIDES + side, following * SIDES + (side + 1) % SIDES
    pairs = np.stack((np.stack((a, b, c), axis=-1), np.stack((b, d, c), axis=-1)), axis=2)
    return np.asarray(pairs.reshape(-1, 3), dtype=np.int64)
