"""Define the parts of a scene: cables with their true axis, solids, table, camera; in the camera's optical frame."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import map_coordinates

from ...types import Array, Bools, Camera, Floats, Ints

Color = tuple[int, int, int]
"""8-bit RGB."""


@dataclass(frozen=True)
class Stripe:
    """Stripes of a second color around a cable.

    Attributes
    ----------
    color
        8-bit RGB.
    pitch
        distance along the cable from one stripe to the next, m.
    share
        fraction, 0 to 1, of the pitch that has this color.
    threads
        number of stripes side by side that wind round the cable like a thread, to the left if negative; 0 for rings.
    """

    color: Color
    pitch: float
    share: float = 0.5
    threads: int = 0


@dataclass(frozen=True)
class Grain:
    """The grain of wood: darker rings around an axis that runs through the object.

    Attributes
    ----------
    point, axis
        axis of the rings in the camera's optical frame: a point (3,) m, and a unit vector (3,).
    pitch
        distance from ring to ring, m.
    strength
        loss of brightness at the darkest part of a ring, as a fraction, 0 to 1.
    wobble
        deviation of the rings from circles, m.
    """

    point: Floats
    axis: Floats
    pitch: float
    strength: float
    wobble: float

    def brightness(self, points: Floats) -> Floats:
        """Return the brightness factors (N,), 1 between the rings, at points (N, 3) m of the camera's optical frame."""
        away = points - self.point
        along = away @ self.axis
        across = away - along[:, None] * self.axis
        bent = self.wobble * (np.sin(along / (23 * self.pitch)) + np.sin(across[:, 0] / (5 * self.pitch)))
        ring = (np.linalg.norm(across, axis=1) + bent) / self.pitch
        return np.asarray(1 - self.strength * (ring % 1) ** 3)


@dataclass(frozen=True)
class Print:
    """A printed table cloth: a square picture, fixed to the table, that repeats along two directions of the plane.

    Attributes
    ----------
    point
        (3,) m, a corner of a square, in the camera's optical frame.
    axes
        (2, 3) unit vectors along the sides of the squares.
    side
        length of a side of a square, m.
    picture
        (P, P) brightness factors.
    """

    point: Floats
    axes: Floats
    side: float
    picture: Floats

    def brightness(self, points: Floats) -> Floats:
        """Return the brightness factors (N,) at points (N, 3) m of the plane, in the camera's optical frame."""
        pixels = (points - self.point) @ self.axes.T * (len(self.picture) / self.side)
        return np.asarray(map_coordinates(self.picture, pixels.T, order=1, mode="grid-wrap"))


@dataclass(frozen=True)
class Truth:
    """A cable whose shape is known: the truth that detections are scored against.

    Attributes
    ----------
    axis
        (P, 3) float64 m, P points of the center line in the camera's optical frame, at most 0.5 mm apart (1.5 mm if read from a
        file).
    radius
        radius of the cable, m.
    closed
        whether the cable is a ring; the last point is then followed by the first, which is not repeated.
    color
        8-bit RGB.
    seen
        (P,) bool, whether the camera sees the cable's surface at each axis point; None before rendering.
    shiny
        (start, end), arc lengths in m, of each stretch where the sensor measures no depth on the cable.
    stripe
        stripes of a second color; None for one color.
    """

    axis: Floats
    radius: float
    closed: bool = False
    color: Color = (200, 40, 40)
    seen: Bools | None = None
    shiny: tuple[tuple[float, float], ...] = ()
    stripe: Stripe | None = None

    @property
    def line(self) -> Floats:
        """The axis points in m; for a closed cable, the first point is repeated at the end."""
        return np.vstack((self.axis, self.axis[:1])) if self.closed else self.axis

    @property
    def arcs(self) -> Floats:
        """The arc length from the first axis point to each axis point, (P,) m."""
        steps = np.linalg.norm(np.diff(self.axis, axis=0), axis=1)
        return np.concatenate(([0.0], np.cumsum(steps)))

    @property
    def length(self) -> float:
        """The length of the axis in m; for a closed cable, of the full round."""
        back = float(np.linalg.norm(self.axis[0] - self.axis[-1])) if self.closed else 0.0
        return float(self.arcs[-1]) + back

    @property
    def spacing(self) -> float:
        """The mean distance in m from one axis point to the next."""
        return self.length / max(len(self.axis) - (0 if self.closed else 1), 1)


@dataclass(frozen=True)
class Solid:
    """An object that is not a cable, as a triangle mesh of V vertices and T triangles.

    Attributes
    ----------
    vertices
        (V, 3) m, in the camera's optical frame.
    triangles
        (T, 3) int, indices of vertices, in either order of rotation.
    color
        8-bit RGB.
    grain
        the grain of its wood; None for one color.
    """

    vertices: Floats
    triangles: Ints
    color: Color = (70, 70, 75)
    grain: Grain | None = None


@dataclass(frozen=True)
class Table:
    """An infinite plane below the cables.

    Attributes
    ----------
    point
        (3,) m, any point of the plane, in the camera's optical frame.
    normal
        (3,) unit vector from the plane towards the side of the camera, in the camera's optical frame.
    color
        8-bit RGB.
    grain
        the grain of its wood; None for one color.
    cloth
        the print of its cloth; None gives each image its own random texture, fixed to the image.
    """

    point: Floats
    normal: Floats
    color: Color = (150, 150, 150)
    grain: Grain | None = None
    cloth: Print | None = None


@dataclass(frozen=True)
class Tree:
    """A branched object of a scene, whose strands are cables of the scene.

    Attributes
    ----------
    nodes
        (N, 3) m, the tips and the junctions, in the camera's optical frame; a junction is a node of three or more strands.
    edges
        for each strand: (index in `Scene.cables`, node at the first point of its axis, node at the last).
    """

    nodes: Floats
    edges: tuple[tuple[int, int, int], ...]

    @property
    def degree(self) -> Ints:
        """The number of strands at each node, (N,): 1 at a tip, 3 or more at a junction."""
        return np.bincount(np.array(self.edges)[:, 1:].ravel(), minlength=len(self.nodes))


@dataclass(frozen=True)
class Scene:
    """Cables, other solids, table, light and camera: all that is needed to render a frame.

    All positions and directions are in the camera's optical frame (x right, y down, z forward).

    Attributes
    ----------
    name
        name of the frame that will be rendered from the scene.
    family, seed
        family name and number that the scene was made from; they also seed the noise of the rendered frame.
    camera
        the intrinsics and the image size.
    cables
        the true cables.
    occluders
        the other solids; not all of them hide a cable.
    table
        the plane below the cables; None for a scene without a table.
    light
        (3,) unit vector towards the light.
    background
        8-bit RGB of pixels where there is no surface.
    trees
        the branched objects, which group cables as their strands; empty for scenes of single cables.
    """

    name: str
    family: str
    seed: int
    camera: Camera
    cables: tuple[Truth, ...]
    occluders: tuple[Solid, ...] = ()
    table: Table | None = None
    light: Array | tuple[float, float, float] = (0.0, 0.0, -1.0)
    background: Color = (28, 30, 34)
    trees: tuple[Tree, ...] = ()


CUBOID_TRIANGLES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
     (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)], dtype=np.int64)  # fmt: skip
"""The 12 triangles of a cuboid as indices of its `corners`, counter-clockwise seen from outside."""


def corners(edges: Floats | tuple[float, ...], middle: tuple[float, ...] = (0.5, 0.5, 0.5)) -> Floats:
    """Return the 8 corners of a cuboid with edges along the axes, (8, 3) m, z changing fastest.

    edges : (3,) lengths of the edges, m. middle : position of the origin inside the cuboid, as fractions of the edges.
    """
    return (np.array(list(np.ndindex(2, 2, 2))) - middle) * edges


def cuboid(vertices: Floats, color: Color = (70, 70, 75)) -> Solid:
    """Return the cuboid with these vertices (8, 3) m, which are the moved points of `corners`."""
    return Solid(vertices, CUBOID_TRIANGLES, color)


def moved_scene(scene: Scene, move_points: Callable[[Floats], Floats], rotate: Callable[[Floats], Floats], name: str) -> Scene:
    """Apply a rigid motion, relative to the camera, to the cables, solids, table and light of a scene.

    Parameters
    ----------
    scene
        the scene, in the camera's optical frame.
    move_points
        function that maps points (N, 3) m before the motion to their positions after it, (N, 3) m, in the camera's optical frame.
    rotate
        function that applies the rotation of the same motion to a direction (3,).
    name
        name of the returned scene.
    """
    table = scene.table
    return replace(
        scene,
        name=name,
        cables=tuple(replace(cable, axis=np.asarray(move_points(cable.axis))) for cable in scene.cables),
        occluders=tuple(replace(solid, vertices=np.asarray(move_points(solid.vertices))) for solid in scene.occluders),
        table=None if table is None else _moved_table(table, move_points, rotate),
        light=tuple(rotate(np.asarray(scene.light)).tolist()),
        trees=tuple(replace(tree, nodes=np.asarray(move_points(tree.nodes))) for tree in scene.trees),
    )


def _moved_table(table: Table, move_points: Callable[[Floats], Floats], rotate: Callable[[Floats], Floats]) -> Table:
    """Apply the rigid motion of `moved_scene` to a table; the print of its cloth is kept, the grain of its wood is dropped."""
    cloth = table.cloth
    if cloth is not None:
        axes = np.array([rotate(axis) for axis in cloth.axes])
        cloth = replace(cloth, point=move_points(cloth.point[None])[0], axes=axes)
    return Table(move_points(table.point[None])[0], rotate(table.normal), table.color, cloth=cloth)
