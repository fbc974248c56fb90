"""Detect ribbons of one color in an image, and trace the strands that they form.

A strand has one color along its length and differs from both of its sides, whatever is behind it. On a plain table the mean color
of the sides differs; in front of a cluttered background, the color of the sides varies while that of the strand does not. Both
increase the score: the mean squared difference of a side's pixels from the strand's color, divided by the variance along the
strand.
"""

from typing import Any, NamedTuple

import cv2
import numpy as np

from ..geometry.noise import LAB_NOISE
from ..kernels import follow_ribbon, ribbon_scores
from ..types import Array, Bools, Floats, Ints

DIRECTIONS = 16
"""Number of directions over half a turn in which ribbons are searched; at most 5.6 degrees off, a ribbon stays in its window."""

WIDTHS_PX = np.array((3.0, 4.5, 6.5, 9.0, 12.5, 17.5, 24.0))
"""Widths of the ribbons that are searched, px of the scaled image, each about 1.4 times the previous one."""

LIGHTNESS_WEIGHT = 0.7
"""Weight of the lightness relative to the two color axes of CIELAB: highlights and shade change the lightness along a strand."""

WINDOW_WIDTHS, MIN_WINDOW_PX = 2.2, 13
"""Length of the window along a ribbon, in widths of the ribbon, and its minimum in px."""

STEP_PX = 2.0
"""px between the samples of a traced strand."""

COLOR_SCALE, MAX_COLOR_COST, COLOR_COST = 8.0, 6.0, 0.5
"""Cost of a color that differs from the strand's: COLOR_COST times the squared distance in CIELAB in units of COLOR_SCALE, which
is capped at MAX_COLOR_COST."""

MAX_SCORE, SEED_SCORE = 3.0, 1.7
"""Logarithms of the ratio of variances: the cap of scores, and the minimum score at which a strand is started, as the mean over
MIN_WINDOW_PX on either side."""

BORDER_PX = round(float(WIDTHS_PX[0]))
"""Distance in px from the border of the image within which no strand is started, since the pixels beyond are extrapolated: the
width of the narrowest ribbon."""

SAME_TURN = np.radians(25.0)
"""Radians; a strand that meets an earlier one at a smaller angle has the same path, and ends. A crossing is steeper."""

MAX_STRANDS = 120
"""Maximum number of strands traced."""


class TracedStrand(NamedTuple):
    """A strand traced in an image.

    Attributes
    ----------
    points
        (P, 2) px, x and y, STEP_PX apart.
    angle
        (P,) radians, direction of the strand, from the x axis towards the y axis.
    width
        (P,) px, running mean of the width with the highest score.
    score
        (P,) logarithm of the ratio of variances minus the cost of the color; NaN where no ribbon is detected.
    """

    points: Floats
    angle: Floats
    width: Floats
    score: Floats

    @property
    def seen(self) -> Bools:
        """The samples (P,) bool at which a ribbon is detected."""
        return np.isfinite(self.score)

    @property
    def length(self) -> float:
        """The length of the strand in px."""
        return len(self.points) * STEP_PX

    @property
    def mean_score(self) -> float:
        """The mean score where a ribbon is detected."""
        return float(np.mean(self.score[np.isfinite(self.score)]))

    @property
    def median_width(self) -> float:
        """The median width in px where a ribbon is detected."""
        return float(np.median(self.width[np.isfinite(self.score)]))


class Ribbons(NamedTuple):
    """The scores of all pixels as the middle of a ribbon.

    Attributes
    ----------
    score
        (DIRECTIONS, H, W) float32, highest logarithm of the ratio of variances over all widths.
    width
        (DIRECTIONS, H, W) uint8, the index in WIDTHS_PX of the width with that score.
    color
        (H, W, 3) float32, the blurred color in CIELAB.
    """

    score: Array
    width: Array
    color: Array


def to_lab(color: Array) -> Array:
    """Return an image (H, W, 3) uint8 RGB in CIELAB, float32, with the lightness multiplied by LIGHTNESS_WEIGHT."""
    lab = cv2.cvtColor(color.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    lab[..., 0] *= LIGHTNESS_WEIGHT
    return np.asarray(lab)


def find_ribbons(lab: Array) -> Ribbons:
    """Return the score of each pixel as the middle of a ribbon in each direction.

    lab : (H, W, 3) float32, from `to_lab`.
    """
    scores, widths = ribbon_scores(lab, DIRECTIONS, WIDTHS_PX, LAB_NOISE**2, WINDOW_WIDTHS, MIN_WINDOW_PX)
    np.log(np.maximum(scores, 0.1, out=scores), out=scores)
    return Ribbons(scores, widths, cv2.GaussianBlur(lab, (0, 0), 1.2))


def trace_strands(ribbons: Ribbons) -> list[TracedStrand]:
    """Return the strands that ribbons form, traced in both directions from the pixels with the highest scores.

    Each step takes the turn and the lateral shift with the best score over the next steps, minus the cost of colors other than
    the strand's. The score in the direction of the strand keeps the path straight through a crossing. Where no ribbon is
    detected, the path is extended straight over a few widths, and ends if no ribbon follows.
    """
    shape = ribbons.color.shape[:2]
    taken, angles = np.zeros(shape, np.uint8), np.zeros(shape, np.float32)
    limits: dict[str, Any] = {"color_scale": COLOR_SCALE, "max_color_cost": MAX_COLOR_COST, "color_cost": COLOR_COST}
    limits |= {"step": STEP_PX, "max_score": MAX_SCORE, "same_turn": SAME_TURN}
    strands = list[TracedStrand]()
    for row, column, angle in zip(*_seeds(ribbons), strict=True):
        if taken[row, column] and _between(angle, angles[row, column]) < 1.6 * SAME_TURN:
            continue
        if len(strands) == MAX_STRANDS:
            break
        starts = (np.array((column, row, angle + turn)) for turn in (0.0, np.pi))
        ahead, back = (follow_ribbon(*ribbons, taken, angles, start, WIDTHS_PX, **limits) for start in starts)
        best = round(angle / np.pi * DIRECTIONS), row, column
        middle = (column, row, angle, WIDTHS_PX[ribbons.width[best]], ribbons.score[best])
        rows = np.vstack((back[::-1] - (0, 0, np.pi, 0, 0), middle, ahead))
        width = float(np.median(rows[:, 3]))
        line = np.rint(rows[:, :2] * 8).astype(np.int32)[:, None]
        cv2.polylines(taken, [line], False, 1, max(3, int(width)), cv2.LINE_8, 3)
        for center, along in zip(np.rint(rows[:, :2]).astype(int).tolist(), rows[:, 2].tolist(), strict=True):
            cv2.circle(angles, center, max(2, int(width / 2)), along, -1)
        strands.append(TracedStrand(rows[:, :2], rows[:, 2], rows[:, 3], rows[:, 4]))
    return strands


def _seeds(ribbons: Ribbons) -> tuple[Ints, Ints, Floats]:
    """Return rows, columns and angles (radians) of the pixels from which strands are traced, the highest rank first."""
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
    """Return the angle between two undirected lines, 0 to pi / 2 radians."""
    return float(abs((first - second + np.pi / 2) % np.pi - np.pi / 2))


def _color_cost(difference: Array) -> Array:
    """Return the cost of color differences (..., 3) in CIELAB."""
    return np.asarray(COLOR_COST * np.minimum((difference**2).sum(axis=-1) / COLOR_SCALE**2, MAX_COLOR_COST))
