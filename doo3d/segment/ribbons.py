"""Ribbons of one color in an image: how much each pixel looks like the middle of one, and the strands they form.

A strand is uniform along its length and differs from both of its sides, whatever is behind it. On a plain table its sides differ
in their mean color; before a busy background they differ because a background varies where a strand does not. Both show in the
mean squared difference of a side's pixels from the strand's color, divided by the variance along the strand.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import cv2
import numpy as np

from ..geometry.noise import LAB_NOISE
from ..kernels import follow_ribbon, ribbon_scores
from ..types import Array, Floats, Ints

DIRECTIONS = 16
"""Directions over half a turn in which ribbons are looked for; 5.6 degrees off, a ribbon is still straight over its window."""

WIDTHS_PX = np.array((3.0, 4.5, 6.5, 9.0, 12.5, 17.5, 24.0))
"""px of the scaled image; widths of the ribbons looked for, each 1.4 times the one before."""

LIGHTNESS_WEIGHT = 0.7
"""Weight of lightness beside the two color axes: highlights and shade change it along a strand."""

WINDOW_WIDTHS, MIN_WINDOW_PX = 2.2, 13
"""Length of the window along a ribbon in its widths, and in px at least."""

STEP_PX = 2.0
"""px between the samples of a traced strand."""

COLOR_SCALE, MAX_COLOR_COST, COLOR_COST = 8.0, 6.0, 0.5
"""A color so far from the strand's, in CIELAB, costs COLOR_COST, and its square up to MAX_COLOR_COST times that."""

MAX_SCORE, SEED_SCORE = 3.0, 1.7
"""Logarithms of the ratio of variances: beyond which more says nothing, above which the mean over MIN_WINDOW_PX on either side
lets a strand begin."""

BORDER_PX = round(float(WIDTHS_PX[0]))
"""px from the image border within which no strand begins, since the pixels beyond are made up: the width of the narrowest."""

SAME_TURN = np.radians(25.0)
"""Angle below which a strand that meets an earlier one follows it, and ends; a crossing is steeper."""

MIN_SAMPLES, MAX_STRANDS = 15, 120
"""Samples of a strand at least; strands traced at most."""


class TracedStrand(NamedTuple):
    """A strand traced in an image.

    Attributes
    ----------
    points
        (P, 2) px, x and y, STEP_PX apart.
    angle
        (P,) radians, direction of the strand, from x to y.
    width
        (P,) px, running mean of the width that answers best.
    score
        (P,) logarithm of the ratio of variances less the cost of the color; NaN where the strand is not seen.
    """

    points: Floats
    angle: Floats
    width: Floats
    score: Floats


class Ribbons(NamedTuple):
    """How much each pixel looks like the middle of a ribbon.

    Attributes
    ----------
    score
        (DIRECTIONS, H, W) float32, logarithm of the ratio of variances of the width that answers best.
    width
        (DIRECTIONS, H, W) uint8, the index of that width in WIDTHS_PX.
    color
        (H, W, 3) float32, the blurred color.
    """

    score: Array
    width: Array
    color: Array


def to_lab(color: Array) -> Array:
    """Return the color of an image (H, W, 3) uint8 RGB in CIELAB with lightness weighted by LIGHTNESS_WEIGHT, float32."""
    lab = cv2.cvtColor(color.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    lab[..., 0] *= LIGHTNESS_WEIGHT
    return np.asarray(lab)


def find_ribbons(lab: Array) -> Ribbons:
    """Return how much each pixel looks like the middle of a ribbon in each direction.

    lab : (H, W, 3) float32, from `to_lab`.
    """
    scores, widths = ribbon_scores(lab, DIRECTIONS, WIDTHS_PX, LAB_NOISE**2, WINDOW_WIDTHS, MIN_WINDOW_PX)
    np.log(np.maximum(scores, 0.1, out=scores), out=scores)
    return Ribbons(scores, widths, cv2.GaussianBlur(lab, (0, 0), 1.2))


def trace_strands(ribbons: Ribbons) -> list[TracedStrand]:
    """Return the strands that ribbons form, traced from the places that look most like one, in both directions.

    Each step takes the turn and the shift sideways with the best score, in the color of the strand, over the next steps; the
    score in the direction of the strand keeps it on its way through a crossing. Where nothing answers it goes straight on for a
    few widths, and ends there if nothing comes.
    """
    shape = ribbons.color.shape[:2]
    taken, angles = np.zeros(shape, np.uint8), np.zeros(shape, np.float32)
    follow = partial(
        follow_ribbon,
        color_scale=COLOR_SCALE,
        max_color_cost=MAX_COLOR_COST,
        color_cost=COLOR_COST,
        step=STEP_PX,
        max_score=MAX_SCORE,
        same_turn=SAME_TURN,
    )
    strands = list[TracedStrand]()
    tries = 0
    for row, column, angle in zip(*_seeds(ribbons), strict=True):
        if taken[row, column] and _between(angle, angles[row, column]) < 1.6 * SAME_TURN:
            continue
        tries += 1
        if tries > MAX_STRANDS:
            break
        ahead, back = (follow(*ribbons, taken, angles, np.array((column, row, angle + turn)), WIDTHS_PX) for turn in (0.0, np.pi))
        best = round(angle / np.pi * DIRECTIONS), row, column
        middle = (column, row, angle, WIDTHS_PX[ribbons.width[best]], ribbons.score[best])
        rows = np.vstack((back[::-1] - (0, 0, np.pi, 0, 0), middle, ahead))
        width = float(np.median(rows[:, 3]))
        line = np.rint(rows[:, :2] * 8).astype(np.int32)[:, None]
        cv2.polylines(taken, [line], False, 1, max(3, int(width)), cv2.LINE_8, 3)
        for center, along in zip(np.rint(rows[:, :2]).astype(int).tolist(), rows[:, 2].tolist(), strict=True):
            cv2.circle(angles, center, max(2, int(width / 2)), along, -1)
        if len(rows) >= MIN_SAMPLES:
            strands.append(TracedStrand(rows[:, :2], rows[:, 2], rows[:, 3], rows[:, 4]))
    return strands


def _seeds(ribbons: Ribbons) -> tuple[Ints, Ints, Floats]:
    """Return rows, columns and angles of the pixels from which strands are traced, the most likely first."""
    best = ribbons.score.max(axis=0)
    height, width = best.shape
    local = (best >= cv2.dilate(best, np.ones((3, 3))) - 1e-6) & (best > SEED_SCORE)
    local[:BORDER_PX] = local[-BORDER_PX:] = local[:, :BORDER_PX] = local[:, -BORDER_PX:] = False
    rows, columns = np.nonzero(local)
    chosen = ribbons.score[:, rows, columns].argmax(axis=0)
    angle = chosen * np.pi / DIRECTIONS
    along = np.arange(-MIN_WINDOW_PX, MIN_WINDOW_PX + 1, 2)
    v = np.clip(np.rint(rows[:, None] + along * np.sin(angle)[:, None]).astype(int), 0, height - 1)
    u = np.clip(np.rint(columns[:, None] + along * np.cos(angle)[:, None]).astype(int), 0, width - 1)
    near = [ribbons.score[(chosen + turn)[:, None] % DIRECTIONS, v, u] for turn in (-1, 0, 1)]
    cost = _color_cost(ribbons.color[v, u] - ribbons.color[rows, columns][:, None])
    rank = (np.minimum(np.maximum.reduce(near), MAX_SCORE) - cost).mean(axis=1)
    order = np.argsort(-rank, kind="stable")
    order = order[rank[order] > SEED_SCORE]
    return rows[order], columns[order], angle[order]


def _between(first: float, second: float) -> float:
    """Return the angle in radians between two directions, up to a right angle."""
    return float(abs((first - second + np.pi / 2) % np.pi - np.pi / 2))


def _color_cost(difference: Array) -> Array:
    """Return the cost of color differences (..., 3) in CIELAB."""
    return np.asarray(COLOR_COST * np.minimum((difference**2).sum(axis=-1) / COLOR_SCALE**2, MAX_COLOR_COST))
