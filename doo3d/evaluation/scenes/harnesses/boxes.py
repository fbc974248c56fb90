"""Hide a junction of a harness under a box."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..model import Solid
from ..studio import GRIPPER_COLORS, Studio, box
from .strands import Strand


def box_on_junction(rng: Generator, studio: Studio, strands: list[Strand], nodes: Floats) -> tuple[Solid, ...]:
    """Return a box that lies on one of the junctions."""
    count = np.bincount([node for strand in strands for node in strand.nodes])
    node = int(rng.choice(np.flatnonzero(count > 2)))
    tall = rng.uniform(0.012, 0.03)
    top = max(strand.radius for strand in strands) * 2 + 0.001
    middle = np.array([*nodes[node, :2], top + tall / 2])
    footprint = (rng.uniform(0.025, 0.045), rng.uniform(0.025, 0.045), tall)
    return (box(middle, footprint, rng.uniform(0, np.pi), studio, GRIPPER_COLORS[rng.integers(len(GRIPPER_COLORS))]),)
