"""Add a cable of its own that only touches a harness."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..curves import STEP, headed_curve, random_curves
from ..studio import pick
from .strands import CLEARANCE, NEAR_JUNCTION_RADII, Strand, near_points


def add_touching(rng: Generator, strands: list[Strand], nodes: list[Floats]) -> bool:
    """Add a cable of its own whose tip touches a strand from the side; False if there is no room."""
    radius = max(strand.radius for strand in strands)
    for _ in range(30):
        host = pick(rng, strands)
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
        angle = np.arctan2(normal[1], normal[0]) + rng.uniform(-0.5, 0.5)
        curve = headed_curve(curve, angle) + host.curve[index] + normal * (flat + gap)
        added = Strand(curve, thin, (len(nodes), len(nodes) + 1), np.full(len(curve), thin))
        limit = CLEARANCE * (radius + thin)
        clear = True
        for strand in strands:
            i, _ = near_points(curve, strand.curve, limit, 0.0)
            clear &= not len(i) or (strand is host and bool((i * STEP < 3 * limit).all()))
        if clear:
            strands.append(added)
            nodes.extend((curve[0], curve[-1]))
            return True
    return False
