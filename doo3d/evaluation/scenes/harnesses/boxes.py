"""Hide a junction of a harness under a box."""

import numpy as np
from numpy.random import Generator
from scipy.spatial import Delaunay

from ....types import Floats
from ..curves import rotation
from ..model import Solid
from ..stacking import AXIS_SPACING
from ..studio import GRIPPER_COLORS, Studio, box, pick
from .strands import Strand

WIDE_GAPS = (0.04, 0.08)
"""Least and greatest distance in m between the visible parts of a trunk on both sides of a wide box."""

MIN_HIDDEN_RADII = 3.5
"""Least distance from a hidden junction to the nearest side of a wide box, in radii of the thickest strand."""

MIN_SEEN = 0.03
"""Least length in m of each strand that a wide box leaves visible."""

AIM_RADII = 2.0
"""Greatest distance, in radii of the thickest strand, at which straight continuations of the visible ends pass the hidden
junction."""


def box_on_junction(rng: Generator, studio: Studio, strands: list[Strand], nodes: Floats) -> tuple[Solid, ...]:
    """Return a box on a random junction."""
    count = np.bincount([node for strand in strands for node in strand.nodes])
    node = int(rng.choice(np.flatnonzero(count > 2)))
    tall = rng.uniform(0.012, 0.03)
    top = max(strand.radius for strand in strands) * 2 + 0.001
    middle = np.array([*nodes[node, :2], top + tall / 2])
    footprint = (rng.uniform(0.025, 0.045), rng.uniform(0.025, 0.045), tall)
    return (box(middle, footprint, rng.uniform(0, np.pi), studio, pick(rng, GRIPPER_COLORS)),)


def wide_box(
    rng: Generator, studio: Studio, strands: list[Strand], axes: list[Floats], nodes: Floats
) -> tuple[Solid, ...] | None:
    """Return a box that hides a junction and some centimetres of each strand; None if the hidden shape would be ambiguous.

    The straight continuations of the three visible ends must come together at the junction, and the box hides nothing else.

    Parameters
    ----------
    rng
        the random number generator to draw from.
    studio
        the camera.
    strands
        the strands of the scene.
    axes
        (P, 3) m for each strand, its axis in the world frame.
    nodes
        (N, 3) m, in the world frame.
    """
    count = np.bincount([node for strand in strands for node in strand.nodes])
    node = int(rng.choice(np.flatnonzero(count == 3)))
    thick = max(strand.radius for strand in strands)
    least = 2 * MIN_HIDDEN_RADII * thick
    size = rng.uniform((max(least, WIDE_GAPS[0]), least, 0.012), (WIDE_GAPS[1], 0.06, 0.03))
    meeting = [k for k, strand in enumerate(strands) if node in strand.nodes]
    trunk = next(k for k in meeting if strands[k].trunk)
    ahead = _from_node(strands[trunk], axes[trunk], node)[20] - nodes[node]
    angle = float(np.arctan2(ahead[1], ahead[0]) + rng.uniform(-0.3, 0.3))
    slack = (size[:2] - least) / 2 * rng.uniform(-1, 1, size=2)
    shift = slack @ rotation(angle)
    middle = np.array([*(nodes[node, :2] + shift), 2 * thick + 0.001 + size[2] / 2])
    solid = box(middle, (size[0], size[1], size[2]), angle, studio, pick(rng, GRIPPER_COLORS))
    outline = Delaunay(studio.camera.project(solid.vertices))
    starts, headings = [], []
    for k, (strand, axis) in enumerate(zip(strands, axes, strict=True)):
        line = _from_node(strand, axis, node) if k in meeting else axis
        hidden = outline.find_simplex(studio.camera.project(studio.to_camera(line))) >= 0
        if k not in meeting:
            if hidden.any():
                return None
            continue
        first = int(np.argmin(hidden))
        if hidden[first:].any() or (len(line) - first) * AXIS_SPACING < MIN_SEEN:
            return None
        starts.append(line[first])
        headings.append((line[first + 20] - line[first]) / np.linalg.norm(line[first + 20] - line[first]))
    ends = np.array([start for start, k in zip(starts, meeting, strict=True) if strands[k].trunk])
    if not WIDE_GAPS[0] <= np.linalg.norm(ends[0] - ends[1]) <= WIDE_GAPS[1] + 0.01:
        return None
    return (solid,) if np.linalg.norm(_nearest_point(starts, headings) - nodes[node]) < AIM_RADII * thick else None


def _from_node(strand: Strand, axis: Floats, node: int) -> Floats:
    """Return the axis of a strand, ordered to start at one of its nodes."""
    return axis if strand.nodes[0] == node else axis[::-1]


def _nearest_point(starts: list[Floats], headings: list[Floats]) -> Floats:
    """Return the point with the least sum of squared distances to straight lines, (3,) m."""
    across = [np.eye(3) - np.outer(heading, heading) for heading in headings]
    ahead = np.sum([a @ start for a, start in zip(across, starts, strict=True)], axis=0)
    return np.asarray(np.linalg.solve(np.sum(across, axis=0), ahead))
