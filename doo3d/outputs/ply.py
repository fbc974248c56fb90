"""Encode points and edges as PLY."""

import numpy as np

from ..types import Array, Floats, Ints


def encode_points(points: Floats, colors: Array, edges: Ints) -> bytes:
    """Encode points and edges as the bytes of a binary little-endian PLY file.

    Parameters
    ----------
    points
        (N, 3), N points, or (N, 2), which get z = 0; written as float64 without change of unit.
    colors
        (N, 3) uint8, RGB color of each point.
    edges
        (E, 2) int, for each of E edges the indices of the two points that it joins; (0, 2) for none.
    """
    vertices = np.zeros(
        len(points), dtype=[*((name, "<f8") for name in "xyz"), *((name, "u1") for name in ("red", "green", "blue"))]
    )
    for axis in range(points.shape[1]):
        vertices["xyz"[axis]] = points[:, axis]
    for i, name in enumerate(("red", "green", "blue")):
        vertices[name] = colors[:, i]
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    head += [f"property double {name}" for name in "xyz"] + [f"property uchar {name}" for name in ("red", "green", "blue")]
    if len(edges):
        head += [f"element edge {len(edges)}", "property int vertex1", "property int vertex2"]
    return ("\n".join([*head, "end_header"]) + "\n").encode("ascii") + vertices.tobytes() + edges.astype("<i4").tobytes()
