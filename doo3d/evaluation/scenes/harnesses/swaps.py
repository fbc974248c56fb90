"""Draw strands in the plane that run side by side and swap sides by crossing once."""

import numpy as np
from numpy.random import Generator

from ....types import Floats
from ..curves import STEP, headed_curve, offset_curve, random_curves, resample_polyline, rotation
from ..placing import MIN_BEND_RADII
from ..studio import Studio, pick
from .plan import BRANCH_RATIOS, LEAVING_DEGREES, MIN_SPACING_RADII, Plan, leaving_curve, placed, strand_on_table
from .strands import Strand, crossings_of, is_open

CONTACT_SPACINGS, APART_SPACINGS, CONTACT_CHANCE = (1.04, 1.15), (1.4, 2.6), 0.25
"""Distance between the axes of strands side by side, in sums of their radii: in contact, and apart; probability of contact."""

CROSSING_DEGREES = (24.0, 45.0)
"""Least and greatest angle in degrees at which the strands cross."""

RUNS = (0.03, 0.07)
"""Least and greatest length in m of the side-by-side run on each side of the crossing."""

FLARES, FLARE_LENGTH = (0.025, 0.045), 0.11
"""After that run: distance in m by which each strand turns away, and length in m over which it does."""

HUMP, HUMP_LENGTHS = 0.03, (0.06, 0.08)
"""Branch that runs along its trunk: greatest distance in m before it returns to the trunk, and lengths in m of leaving and
returning."""

GENTLE_BEND = 0.12
"""Least radius of curvature in m of the line along which strands run side by side."""

DRAW_CHANCES = (0.44, 0.24, 0.32)
"""Probabilities of trying two trees, a branch along its trunk, and two branches; two trees fit into the image least often."""


def plan_swap(rng: Generator, studio: Studio, radius: float) -> Plan | None:
    """Draw two strands that swap sides; None if they do not fit.

    The strands belong to two trees, or are a trunk and its branch, or two branches of one trunk.

    Parameters
    ----------
    rng
        the random number generator to draw from.
    studio
        the camera, which bounds the part of the table that is used.
    radius
        radius of the thickest trunk, m.
    """
    draw = rng.choice(np.array([_two_trees, _branch_along_trunk, _two_branches], dtype=object), p=DRAW_CHANCES)
    usable = np.array(studio.usable_size())
    for _ in range(60):
        plan = draw(rng, radius)
        if plan is None:
            continue
        plan = placed(rng, plan, usable)
        if plan is not None and _is_natural(plan.strands, radius):
            return plan
    return None


def _two_trees(rng: Generator, radius: float) -> Plan | None:
    """Draw two trunks along one line, each with a branch on the outer side."""
    base = random_curves(rng, 1, rng.uniform(0.48, 0.68), GENTLE_BEND)[0]
    along = np.arange(len(base)) * STEP
    other = radius * rng.uniform(0.8, 1.0)
    gap = _spacing(rng, radius + other)
    middle = along[-1] * rng.uniform(0.44, 0.56)
    offset = _swapped(rng, along - middle, gap / 2)
    strands: list[Strand] = []
    nodes: list[Floats] = []
    starts = []
    for sign, thick in ((1, radius), (-1, other)):
        low, high = int(rng.uniform(0, 0.05) / STEP), len(base) - int(rng.uniform(0, 0.05) / STEP)
        trunk = _beside(base[low:high], sign * offset[low:high])
        crossing = int(np.linalg.norm(trunk - base[int(middle / STEP)], axis=1).argmin())
        clear, least = 2.6 * 7 * radius / STEP, MIN_SPACING_RADII * thick / STEP
        sides = [(least, crossing - clear, -1), (crossing + clear, len(trunk) - 1 - least, 1)]
        possible = [side for side in sides if side[1] > side[0]]
        if not possible:
            return None
        first, last, direction = pick(rng, possible)
        index = int(rng.uniform(first, last))
        start = len(nodes)
        starts.append(start)
        # a strand is on the left of the base line after the middle if its offset is positive there
        curve = leaving_curve(rng, trunk, index, sign * direction)
        nodes += [trunk[0], trunk[index], trunk[-1], curve[-1]]
        strands += [
            strand_on_table(trunk[: index + 1], thick, (start, start + 1), thick, trunk=True),
            strand_on_table(trunk[index:], thick, (start + 1, start + 2), thick, trunk=True),
            strand_on_table(curve, thick * rng.uniform(*BRANCH_RATIOS), (start + 1, start + 3), thick),
        ]
    if np.linalg.norm(nodes[1] - nodes[5]) < MIN_SPACING_RADII * radius:
        return None
    return Plan(strands, nodes, starts)


def _branch_along_trunk(rng: Generator, radius: float) -> Plan | None:
    """Draw a trunk with a branch that bends back to it, runs along it and crosses to its other side."""
    trunk = random_curves(rng, 1, rng.uniform(0.55, 0.72), GENTLE_BEND)[0]
    thin = radius * rng.uniform(*BRANCH_RATIOS)
    gap = _spacing(rng, radius + thin)
    index = int(rng.uniform(MIN_SPACING_RADII * radius, 0.14) / STEP)
    along = np.arange(len(trunk) - index) * STEP
    out, back = rng.uniform(*HUMP_LENGTHS, size=2)
    slope = min(np.tan(np.radians(rng.uniform(LEAVING_DEGREES[0], 50.0))), 2.5 * HUMP / out)
    rising = _cubic(along / out, 0.0, slope * out, HUMP, 0.0)
    falling = _cubic((along - out) / back, HUMP, 0.0, gap, 0.0)
    middle = out + back + rng.uniform(*RUNS) + 0.03
    beyond = -_swapped(rng, along - middle, gap)
    beyond = np.where(along < middle, np.minimum(beyond, gap), beyond)
    offset = np.where(along < out, rising, np.where(along < out + back, falling, beyond))
    curve = _beside(trunk[index:], rng.choice((-1, 1)) * offset)
    curve = curve[: len(curve) - int(rng.uniform(0, 0.05) / STEP)]
    strands = [
        strand_on_table(trunk[: index + 1], radius, (0, 1), radius, trunk=True),
        strand_on_table(trunk[index:], radius, (1, 2), radius, trunk=True),
        strand_on_table(curve, thin, (1, 3), radius),
    ]
    return Plan(strands, [trunk[0], trunk[index], trunk[-1], curve[-1]])


def _two_branches(rng: Generator, radius: float) -> Plan | None:
    """Draw a trunk with two branches on one side that come together, run side by side and cross."""
    trunk = random_curves(rng, 1, rng.uniform(0.42, 0.65), GENTLE_BEND)[0]
    least = MIN_SPACING_RADII * radius
    apart = rng.uniform(1.2 * least, 1.2 * least + 0.05)
    free = STEP * (len(trunk) - 1) - 2 * least - apart
    if free <= 0:
        return None
    first = least + rng.uniform(0, free)
    indices = int(first / STEP), int((first + apart) / STEP)
    thin = radius * rng.uniform(*BRANCH_RATIOS, size=2)
    gap = _spacing(rng, float(thin.sum()))
    middle = trunk[sum(indices) // 2]
    heading = _unit(trunk[indices[1]] - trunk[indices[0]])
    side = rng.choice((-1, 1))
    ahead = _turned(side * np.array([-heading[1], heading[0]]), np.radians(rng.uniform(-20, 20)))
    base = random_curves(rng, 1, rng.uniform(0.24, 0.32), GENTLE_BEND / 2)[0]
    base = headed_curve(base, np.arctan2(ahead[1], ahead[0])) + middle + ahead * rng.uniform(0.05, 0.08)
    along = np.arange(len(base)) * STEP
    offset = _swapped(rng, along - rng.uniform(0.07, 0.1), gap / 2)
    start = np.flatnonzero(np.abs(offset) <= gap / 2 * (1 + 1e-9))[0]
    strands: list[Strand] = []
    nodes = [trunk[0], trunk[indices[0]], trunk[indices[1]], trunk[-1]]
    for low, high, k in ((0, indices[0], 0), (indices[0], indices[1], 1), (indices[1], len(trunk) - 1, 2)):
        strands.append(strand_on_table(trunk[low : high + 1], radius, (k, k + 1), radius, trunk=True))
    left_first = (np.array([-ahead[1], ahead[0]]) @ (nodes[1] - nodes[2])) > 0
    for k in (0, 1):
        # before the crossing the strand of positive sign is on the right of the base line
        sign = -1 if (k == 0) == left_first else 1
        line = _beside(base[start:], sign * offset[start:])
        inward = heading if k == 0 else -heading
        leaving = _turned(inward, (side if k == 0 else -side) * np.radians(rng.uniform(50.0, 85.0)))
        reach = 0.45 * float(np.linalg.norm(line[0] - nodes[1 + k]))
        link = _bezier(nodes[1 + k], nodes[1 + k] + reach * leaving, line[0] - reach * _unit(line[2] - line[0]), line[0])
        curve = resample_polyline(np.concatenate((link[:-1], line)), STEP)
        curve = curve[: len(curve) - int(rng.uniform(0, 0.06) / STEP)]
        nodes.append(curve[-1])
        strands.append(strand_on_table(curve, float(thin[k]), (1 + k, 4 + k), radius))
    return Plan(strands, nodes)


def _spacing(rng: Generator, both: float) -> float:
    """Draw the distance in m between two axes side by side, for a sum of radii `both` (m)."""
    return both * rng.uniform(*(CONTACT_SPACINGS if rng.random() < CONTACT_CHANCE else APART_SPACINGS))


def _swapped(rng: Generator, along: Floats, offset: float) -> Floats:
    """Return the offset from a line, (P,) m, of a strand that changes from the right to the left of the line.

    Parameters
    ----------
    rng
        the random number generator to draw from.
    along
        (P,) position along the line, relative to the crossing, m.
    offset
        offset in m on both sides where the strands run side by side; after this run, the offset grows.
    """
    width = 3.0 * offset / np.tan(np.radians(rng.uniform(*CROSSING_DEGREES)))
    t = np.clip(along / width, -1, 1)
    result = offset * t * (3 - t**2) / 2
    for sign in (-1, 1):
        beyond = np.clip((sign * along - width - rng.uniform(*RUNS)) / FLARE_LENGTH, 0, 1)
        result = result + sign * rng.uniform(*FLARES) * beyond**2 * (3 - 2 * beyond)
    return np.asarray(result)


def _beside(line: Floats, offset: Floats) -> Floats:
    """Return the curve at an offset (P,) m to the left of a line (P, 2) m, resampled."""
    return resample_polyline(offset_curve(line, offset), STEP)


def _cubic(t: Floats, start: float, start_slope: float, end: float, end_slope: float) -> Floats:
    """Return the cubic Hermite polynomial at t, 0 to 1; slopes are per unit of t."""
    t = np.clip(t, 0, 1)
    bend = start * (1 - 3 * t**2 + 2 * t**3) + end * (3 * t**2 - 2 * t**3)
    return np.asarray(bend + start_slope * (t - 2 * t**2 + t**3) + end_slope * (t**3 - t**2))


def _bezier(*stops: Floats) -> Floats:
    """Return 60 points of the cubic Bezier curve of four control points (2,)."""
    t = np.linspace(0, 1, 60)[:, None]
    a, b, c, d = stops
    return np.asarray(a * (1 - t) ** 3 + 3 * b * t * (1 - t) ** 2 + 3 * c * t**2 * (1 - t) + d * t**3)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))


def _turned(vector: Floats, angle: float) -> Floats:
    return np.asarray(vector @ rotation(angle))


def _is_natural(strands: list[Strand], radius: float) -> bool:
    """Return whether no strand bends too tightly, and exactly two strands cross once and are clear of all others."""
    crossings = crossings_of(strands, np.radians(CROSSING_DEGREES[0] - 6))
    if len(crossings) != 1 or crossings[0][0] < 0:
        return False
    for strand in strands:
        step = np.diff(strand.curve[::4], axis=0)
        turns = np.abs(np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0]))))
        if (turns > 4 * STEP / max(MIN_BEND_RADII * strand.radius, 0.018)).any():
            return False
    beside = (crossings[0][0], crossings[0][2])
    return is_open(strands, radius, np.radians(CROSSING_DEGREES[0] - 6), beside)
