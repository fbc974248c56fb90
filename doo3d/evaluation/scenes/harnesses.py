"""Families of branched objects: harnesses on a table and hanging, partly hidden, crossing, and beside ends that only touch.

Each builder draws one scene from the given random numbers, or returns None if the draw cannot be built.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.random import Generator
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ...errors import InputError, unread_code
from ...types import Floats
from .curves import STEP, curve_crossings, oriented_curve, random_curves
from .model import Scene, Solid, Tree, Truth
from .stacking import spline_axis
from .studio import GRIPPER_COLORS, Studio, box, cable_color, make_studio

Size = tuple[int, int]
"""Width and height of the image, px."""

TRUNK_RADII, BRANCH_RATIOS = (0.004, 0.007), (0.5, 0.8)
"""m, radius of a trunk; radius of a branch as a fraction of that."""

TRUNK_LENGTHS, BRANCH_LENGTHS = (0.42, 0.75), (0.10, 0.24)
"""m."""

LEAVING_DEGREES = (35.0, 85.0)
"""Degrees between a branch and the trunk where the branch leaves."""

MIN_SPACING_RADII = 14.0
"""Radii of the trunk between two junctions, and from a junction to a tip of the trunk."""

CLEARANCE = 1.6
"""Least distance in the plane of two strands that do not cross, in sums of their radii."""

NEAR_JUNCTION_RADII = 7.0
"""Radii of the trunk from a junction up to which strands are near each other because they meet there."""

MIN_CROSSING_ANGLE = np.radians(35.0)

MOTION_TRUNK, MOTION_BRANCHES, MOTION_RADIUS = tuple(range(13)), ((4, 13, 14, 15, 16), (8, 17, 18, 19)), 0.005
"""Markers along the trunk and along each branch, with the marker of the trunk where it leaves, and m, of a measured cable."""


MIN_MARKER_STEP = 0.02
"""m; markers nearer to the one before are left out of the spline, which would swing between them."""


@dataclass
class _Strand:
    """A strand in the plane, (P, 2) m, 2 mm apart, with radius, heights (P,) and its two nodes; `trunk` tells its kind."""

    curve: Floats
    radius: float
    nodes: tuple[int, int]
    height: Floats
    trunk: bool = False


@dataclass(frozen=True)
class Kind:
    """What a family of harnesses is like.

    Attributes
    ----------
    branches
        (least, greatest) number of branches.
    crossings
        (least, greatest) number of crossings.
    hanging
        whether the object hangs in the air and not on the table.
    hidden
        whether a box hides a junction.
    opposite
        whether two branches leave the trunk at one place, on both sides.
    touching
        whether a cable of its own ends at the side of a strand.
    under
        whether a branch passes under the trunk, rather than at random over or under.
    """

    branches: tuple[int, int] = (1, 3)
    crossings: tuple[int, int] = (0, 0)
    hanging: bool = False
    hidden: bool = False
    opposite: bool = False
    touching: bool = False
    under: bool = False


KINDS = {
    "tree": Kind(),
    "tree_crossing": Kind(crossings=(1, 1)),
    "tree_many": Kind(branches=(4, 6), crossings=(0, 2)),
    "tree_hanging": Kind(hanging=True, crossings=(0, 1)),
    "tree_hidden": Kind(hidden=True),
    "tree_under": Kind(crossings=(1, 1), under=True),
    "tree_opposite": Kind(branches=(2, 3), opposite=True),
    "tree_touch": Kind(touching=True),
}


def harness(kind: Kind, rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of one harness: a trunk with branches, each a tube whose axis begins on the trunk's axis.

    Parameters
    ----------
    kind
        number of branches and crossings, and what else is in the scene.
    rng
        the random number generator to draw from.
    size
        (width, height) px of the image.

    Returns
    -------
    The scene in the camera's optical frame, with one tree (two with a touching cable); None if the draw cannot be built.
    """
    studio = make_studio(rng, size)
    radius = rng.uniform(*TRUNK_RADII)
    strands, nodes = _plan(rng, studio, radius, kind)
    if not strands:
        return None
    count = len(nodes)
    if kind.touching and not _add_touching(rng, strands, nodes):
        return None
    if not _laid(rng, strands, radius, kind):
        return None
    lift = _lift(rng) if kind.hanging else None
    axes = []
    for strand in strands:
        points = np.column_stack((strand.curve, strand.height))
        if lift is not None:
            points[:, 2] += lift(points[:, :2])
        axes.append(spline_axis(points))
    if not all(studio.contains(axis) for axis in axes) or not _are_clear(axes, strands, radius):
        return None
    at = np.zeros((len(nodes), 3))
    for strand, axis in zip(strands, axes, strict=True):
        at[list(strand.nodes)] = axis[[0, -1]]
    color = cable_color(rng)
    cables = tuple(Truth(studio.to_camera(axis), strand.radius, color=color) for strand, axis in zip(strands, axes, strict=True))
    boxes = _boxes(rng, studio, strands, at) if kind.hidden else ()
    table = studio.table(-rng.uniform(0.08, 0.3)) if kind.hanging else studio.table()
    edges = [(k, *strand.nodes) for k, strand in enumerate(strands)]
    trees = [Tree(studio.to_camera(at[:count]), tuple(edge for edge in edges if edge[1] < count))]
    if kind.touching:
        trees.append(Tree(studio.to_camera(at[count:]), ((edges[-1][0], 0, 1),)))
    return Scene("", "", 0, studio.camera, cables, boxes, table, studio.light, trees=tuple(trees))


def _plan(rng: Generator, studio: Studio, radius: float, kind: Kind) -> tuple[list[_Strand], list[Floats]]:
    """Draw trunk and branches in the plane; returns no strands if they do not fit or cross too often."""
    wanted = int(rng.integers(kind.branches[0], kind.branches[1] + 1))
    usable = np.array(studio.usable_size())
    for _ in range(30):
        length = rng.uniform(*TRUNK_LENGTHS)
        trunk = oriented_curve(random_curves(rng, 1, length, 0.05)[0], rng.uniform(-0.4, 0.4))
        if (np.ptp(trunk, axis=0) > usable).any():
            continue
        trunk = trunk + rng.uniform(-0.4, 0.4, size=2) * (usable - np.ptp(trunk, axis=0))
        indices = _branch_points(rng, len(trunk), wanted, radius, kind)
        if indices is None:
            continue
        stations = sorted(set(indices))
        nodes = [trunk[0], *(trunk[i] for i in stations), trunk[-1]]
        bounds = [0, *stations, len(trunk) - 1]
        strands = [_strand(trunk[a : b + 1], radius, (k, k + 1), radius, trunk=True)
                   for k, (a, b) in enumerate(itertools.pairwise(bounds))]  # fmt: skip
        side = rng.choice((-1, 1))
        for index in indices:
            side = -side if kind.opposite or rng.random() < 0.5 else side
            thin = radius * rng.uniform(*BRANCH_RATIOS)
            heading = trunk[min(index + 4, len(trunk) - 1)] - trunk[index - 4]
            angle = np.arctan2(heading[1], heading[0]) + side * np.radians(rng.uniform(*LEAVING_DEGREES))
            curve = random_curves(rng, 1, rng.uniform(*BRANCH_LENGTHS) * (1.5 if kind.crossings[1] else 1), 0.03)[0]
            curve = curve - curve[0]
            first = curve[4]
            turn = angle - np.arctan2(first[1], first[0])
            curve = curve @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + trunk[index]
            nodes.append(curve[-1])
            strands.append(_strand(curve, thin, (1 + stations.index(index), len(nodes) - 1), radius))
        points = np.vstack([strand.curve for strand in strands])
        inside = (np.abs(points) < usable / 2).all()
        if inside and kind.crossings[0] <= len(_crossings(strands)) <= kind.crossings[1] and _is_open(strands, radius):
            return strands, nodes
    return [], []


def _strand(curve: Floats, radius: float, nodes: tuple[int, int], trunk_radius: float, trunk: bool = False) -> _Strand:
    """Return a strand that lies on the table, and rises to the trunk's axis at its first point."""
    along = np.arange(len(curve)) * STEP / (8 * trunk_radius)
    rise = np.clip(1 - along, 0, 1)
    height = np.full(len(curve), radius) + (trunk_radius - radius) * rise**2 * (3 - 2 * rise)
    return _Strand(curve, radius, nodes, height, trunk)


def _branch_points(rng: Generator, count: int, wanted: int, radius: float, kind: Kind) -> list[int] | None:
    """Return the index of the trunk point where each branch leaves; with `opposite` the first two at one place."""
    least = MIN_SPACING_RADII * radius / STEP
    places = wanted - 1 if kind.opposite else wanted
    for _ in range(20):
        at = np.sort(rng.uniform(least, count - 1 - least, size=places))
        if places == 1 or np.diff(at).min() > least:
            chosen = [int(value) for value in rng.permutation(at)]
            return [chosen[0], *chosen] if kind.opposite else chosen
    return None


def _crossings(strands: list[_Strand]) -> list[tuple[int, int, int, int]]:
    """Return the crossings of strands in the plane: (strand, point of it, other strand, point of that); none at junctions."""
    points = np.vstack([strand.curve for strand in strands])
    number = np.repeat(np.arange(len(strands)), [len(strand.curve) for strand in strands])
    first = np.cumsum([0, *(len(strand.curve) for strand in strands)])
    found = curve_crossings(points, number)
    result = []
    for i, j, angle in zip(found.first, found.second, found.angles, strict=True):
        a, b = int(number[int(i)]), int(number[int(j)])
        p, q = int(i) - int(first[a]), int(j) - int(first[b])
        shared = set(strands[a].nodes) & set(strands[b].nodes)
        if a != b and shared and min(p, len(strands[a].curve) - p) < 6 and min(q, len(strands[b].curve) - q) < 6:
            continue
        result.append((a, p, b, q) if angle > MIN_CROSSING_ANGLE else (-1, 0, 0, 0))
    return result


def _is_open(strands: list[_Strand], radius: float) -> bool:
    """Tell whether strands come near each other only where they meet or cross, and cross far from junctions and tips."""
    crossings = _crossings(strands)
    if any(crossing[0] < 0 for crossing in crossings):
        return False
    reach = 2.5 * NEAR_JUNCTION_RADII * radius / STEP
    for a, p, b, q in crossings:
        if min(p, len(strands[a].curve) - p, q, len(strands[b].curve) - q) < reach:
            return False
    for a, first in enumerate(strands):
        for b in range(a, len(strands)):
            second = strands[b]
            limit = CLEARANCE * (first.radius + second.radius)
            i, j = _near(first.curve, second.curve, limit, limit if a == b else 0.0)
            for crossing in crossings:
                if (crossing[0], crossing[2]) == (a, b):
                    far = (np.abs(i - crossing[1]) > 3 * limit / STEP) | (np.abs(j - crossing[3]) > 3 * limit / STEP)
                    i, j = i[far], j[far]
            if a != b:
                for node in set(first.nodes) & set(second.nodes):
                    from_first = i if first.nodes[0] == node else len(first.curve) - 1 - i
                    from_second = j if second.nodes[0] == node else len(second.curve) - 1 - j
                    far = np.maximum(from_first, from_second) * STEP > NEAR_JUNCTION_RADII * radius
                    i, j = i[far], j[far]
            if len(i):
                return False
    return True


def _near(first: Floats, second: Floats, limit: float, apart: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of the pairs of points nearer than `limit`; in one curve only those over 4 limits along it."""
    pairs = cKDTree(first).sparse_distance_matrix(cKDTree(second), limit, output_type="coo_matrix")
    i, j = pairs.row, pairs.col
    if apart:
        chosen = (j - i) * STEP > 4 * apart
        i, j = i[chosen], j[chosen]
    return i, j


def _laid(rng: Generator, strands: list[_Strand], radius: float, kind: Kind) -> bool:
    """Lift the upper strand over the lower one at each crossing; False if that cannot be done."""
    for a, p, b, q in _crossings(strands):
        upper_first = strands[a].trunk if kind.under and strands[a].trunk != strands[b].trunk else bool(rng.random() < 0.5)
        (up, at), (low, below) = ((a, p), (b, q)) if upper_first else ((b, q), (a, p))
        both = strands[up].radius + strands[low].radius
        gap = 1.05 * both * (rng.uniform(1, 5) if kind.hanging else 1.0)
        need = strands[low].height[below] + gap - strands[up].height[at]
        width = max(7 * both, 3 * need) / STEP
        along = np.arange(len(strands[up].curve)) - at
        strands[up].height = strands[up].height + max(need, 0.0) * np.exp(-((along / width) ** 2) * 2)
        ends = strands[up].height[[0, -1]] - [strands[up].height.min()] * 2
        if (ends > 2.5 * radius).any():
            return False
    return _joined(strands)


def _joined(strands: list[_Strand]) -> bool:
    """Give all strands at a node one height, that of the highest, blended in along each strand."""
    top: dict[int, float] = {}
    shared: dict[int, int] = {}
    for strand in strands:
        for node, height in zip(strand.nodes, strand.height[[0, -1]], strict=True):
            top[node] = max(top.get(node, 0.0), float(height))
            shared[node] = shared.get(node, 0) + 1
    for strand in strands:
        along = np.arange(len(strand.curve)) * STEP
        for side, node in enumerate(strand.nodes):
            if shared[node] > 1:
                missing = top[node] - strand.height[-side]
                strand.height = strand.height + missing * np.exp(-(((along if side == 0 else along[-1] - along) / 0.02) ** 2))
    return True


def _are_clear(axes: list[Floats], strands: list[_Strand], radius: float) -> bool:
    """Tell whether no two strands run into each other, except where they meet."""
    for a, first in enumerate(axes):
        for b in range(a + 1, len(axes)):
            both = strands[a].radius + strands[b].radius
            distance = cKDTree(axes[b]).query(first)[0]
            close = distance < 0.97 * both
            for node in set(strands[a].nodes) & set(strands[b].nodes):
                at = first[0] if strands[a].nodes[0] == node else first[-1]
                close &= np.linalg.norm(first - at, axis=1) > 1.6 * NEAR_JUNCTION_RADII * radius
            if close.any():
                return False
    return True


def _add_touching(rng: Generator, strands: list[_Strand], nodes: list[Floats]) -> bool:
    """Add a cable of its own whose tip touches a strand from the side; False if there is no room."""
    radius = max(strand.radius for strand in strands)
    for _ in range(30):
        host = strands[int(rng.integers(len(strands)))]
        reach = int(2.5 * NEAR_JUNCTION_RADII * radius / STEP)
        if len(host.curve) <= 2 * reach + 2:
            continue
        index = int(rng.integers(reach, len(host.curve) - reach))
        heading = host.curve[index + 2] - host.curve[index - 2]
        normal = rng.choice((-1, 1)) * np.array([-heading[1], heading[0]]) / np.linalg.norm(heading)
        thin = host.radius * rng.uniform(0.6, 1.0)
        gap = rng.uniform(0.0, 0.0006)
        flat = np.sqrt((host.radius + thin) ** 2 - (host.radius - thin) ** 2)
        curve = random_curves(rng, 1, rng.uniform(0.12, 0.22), 0.03)[0]
        curve = curve - curve[0]
        turn = np.arctan2(normal[1], normal[0]) + rng.uniform(-0.5, 0.5) - np.arctan2(curve[4][1], curve[4][0])
        curve = curve @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        curve = curve + host.curve[index] + normal * (flat + gap)
        added = _Strand(curve, thin, (len(nodes), len(nodes) + 1), np.full(len(curve), thin))
        limit = CLEARANCE * (radius + thin)
        clear = True
        for strand in strands:
            i, _ = _near(curve, strand.curve, limit, 0.0)
            clear &= not len(i) or (strand is host and bool((i * STEP < 3 * limit).all()))
        if clear:
            strands.append(added)
            nodes.extend((curve[0], curve[-1]))
            return True
    return False


def _lift(rng: Generator) -> Callable[[Floats], Floats]:
    """Return a smooth height over the plane, (P, 2) m -> (P,) m, for objects that hang in the air."""
    waves = rng.normal(size=(3, 2)) * 9.0
    phases, size = rng.uniform(0, 6, 3), rng.uniform(0.008, 0.02)
    return lambda points: np.asarray(size * np.sin(points @ waves.T + phases).sum(axis=1))


def _boxes(rng: Generator, studio: Studio, strands: list[_Strand], nodes: Floats) -> tuple[Solid, ...]:
    """Return a box that lies on one of the junctions."""
    count = np.bincount([node for strand in strands for node in strand.nodes])
    node = int(rng.choice(np.flatnonzero(count > 2)))
    tall = rng.uniform(0.012, 0.03)
    top = max(strand.radius for strand in strands) * 2 + 0.001
    middle = np.array([*nodes[node, :2], top + tall / 2])
    footprint = (rng.uniform(0.025, 0.045), rng.uniform(0.025, 0.045), tall)
    return (box(middle, footprint, rng.uniform(0, np.pi), studio, GRIPPER_COLORS[rng.integers(len(GRIPPER_COLORS))]),)


def motion_tree(path: str | Path, rng: Generator, size: Size) -> Scene | None:
    """Draw a scene of a measured branched cable: one frame of a motion capture, seen by a camera drawn at random.

    Parameters
    ----------
    path
        an .npy file (T, 20, 3) of marker positions in m: 13 along the trunk, 4 and 3 along two branches, which leave the trunk
        at its markers 4 and 8.
    rng
        the random number generator to draw from.
    size
        (width, height) px of the image.

    Returns
    -------
    The scene in the camera's optical frame, without a table; None if the cable would touch itself.

    Raises
    ------
    InputError : the file cannot be read or holds something else.
    """
    try:
        frames = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        code = unread_code(error) if isinstance(error, OSError) else "truth-invalid"
        raise InputError(f"{path}: cannot be read ({error})", code=code) from None
    if frames.ndim != 3 or frames.shape[1:] != (20, 3):
        raise InputError(f"{path}: has shape {frames.shape}, expected (T, 20, 3) positions of markers", code="truth-invalid")
    markers = np.asarray(frames[int(rng.integers(len(frames)))], dtype=float)
    curves = [markers[list(MOTION_TRUNK)], *(markers[list(branch)] for branch in MOTION_BRANCHES)]
    center = (markers.max(axis=0) + markers.min(axis=0)) / 2
    _, _, principal = np.linalg.svd(markers - center, full_matrices=False)
    turn = Rotation.from_euler("xyz", rng.uniform(-1, 1, 3) * (0.5, 0.5, 0.3)).as_matrix() @ principal
    studio = make_studio(rng, size, (0.8, 1.0), 0.0)
    placed = [(curve - center) @ turn.T for curve in curves]
    while not all(studio.contains(curve) for curve in placed):
        studio = replace(studio, distance=1.05 * studio.distance)
        if studio.distance > 2.5:
            return None
    axes = []
    for k, stops in enumerate(((0, 4, 8, 12), (0, 4), (0, 3))):
        moved = np.concatenate(([True], np.linalg.norm(np.diff(placed[k], axis=0), axis=1) > MIN_MARKER_STEP))
        moved[list(stops)] = True
        axis = spline_axis(placed[k][moved])
        at = [int(np.linalg.norm(axis - placed[k][stop], axis=1).argmin()) for stop in stops]
        axes += [axis[low : high + 1] for low, high in itertools.pairwise(at)]
    nodes = np.array([axes[0][0], axes[1][0], axes[2][0], axes[2][-1], axes[3][-1], axes[4][-1]])
    joined = ((0, 1), (1, 2), (2, 3), (1, 4), (2, 5))
    color = cable_color(rng)
    cables = tuple(Truth(studio.to_camera(axis), MOTION_RADIUS, color=color) for axis in axes)
    tree = Tree(studio.to_camera(nodes), tuple((k, *pair) for k, pair in enumerate(joined)))
    return Scene("", "", 0, studio.camera, cables, (), None, studio.light, trees=(tree,))


TREES = {name: partial(harness, kind) for name, kind in KINDS.items()}
"""Families of scenes of branched objects: name -> builder."""
