"""Which of two strands that cross in the view is the upper one, as surface and colour say it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...geometry.intersections import Intersections, PolylineSet
from ...types import Array, Floats, Ints

ALONG = np.linspace(0.0, 5.0, 16)
"""Half-widths beyond the overlap, on both sides, at which a strand is looked at."""

CLEAR = 1.2
"""Half-lengths of the overlap that are left out of what counts as beyond it."""

ACROSS = np.linspace(-0.75, 0.75, 7)
"""Half-widths from the middle of a strand at which its colour is looked at."""

MIDDLE = (-0.4, 0.0, 0.4)
"""The same for its surface, which falls away steeply at the sides."""

FLATTEST = 0.3
"""rad; strands that cross at less are taken to cross at this, or their overlap would have no end."""

LEAST = 4
"""Places on both sides of a crossing together at which a strand must have been measured, to be carried on across."""

Look = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Strands:
    """The two strands at each of C crossings.

    middle : (C, 2, S, 2) places in the view along them, S / 2 before the overlap and S / 2 behind it, NaN beyond their ends.
    depth : (C, 2, S) distance of their axes. side : (C, 2, S, 2) unit, square to them. along : (C, 2, S) half-widths from
    the crossing, signed. half : (C, 2) half-width. place : (C, 2) of the crossings. normal : (C, 2, 2) unit, square to each
    strand there.
    """

    middle: Floats
    depth: Floats
    side: Floats
    along: Floats
    half: Floats
    place: Floats
    normal: Floats


def strands(found: Intersections, lines: PolylineSet, half: Floats) -> Strands:
    """What to look at.

    lines : the chains in the view with their distance, (J, 3). half : (C, 2), half the width of each strand there.
    """
    joint = found.segment + found.t
    step = _steps(lines, found.chain, found.segment)
    size = np.maximum(np.linalg.norm(step, axis=-1), 1e-12)
    overlap = CLEAR * half[:, ::-1] / np.sin(np.maximum(found.angle, FLATTEST))[:, None]
    beyond = overlap[..., None] + ALONG * half[..., None]
    away = np.concatenate((-beyond[..., ::-1], beyond), axis=-1)
    chain = np.broadcast_to(found.chain[..., None], away.shape)
    at = joint[..., None] + away / size[..., None]
    middle = lines.interpolate(chain, at)
    side = _square(_steps(lines, chain, np.floor(at)))
    return Strands(middle[..., :2], middle[..., 2], side, away / half[..., None], half, found.point, _square(step))


def _steps(lines: PolylineSet, chain: Ints, segment: Array) -> Floats:
    """(..., 2) from one joint to the next in the view; NaN beyond the ends."""
    return np.asarray((lines.interpolate(chain, segment + 1.0) - lines.interpolate(chain, segment + 0.0))[..., :2])


def _square(step: Floats) -> Floats:
    size = np.maximum(np.linalg.norm(step, axis=-1, keepdims=True), 1e-12)
    return np.asarray(np.stack((-step[..., 1], step[..., 0]), axis=-1) / size)


def over(seen: Strands, across: Array) -> tuple[Floats, Floats]:
    """Places (C, 2, S, A, 2) beside the strands, `across` (A,) half-widths from their middles, and (C, A, A, 2) in the overlaps.

    Of the latter the place [c, a, b] is across[a] from the middle of the first strand and across[b] from that of the second.
    """
    offset = (across * seen.half[..., None])[:, :, None, :, None]
    beside = seen.middle[..., None, :] + offset * seen.side[..., None, :]
    n = seen.normal
    turn = n[:, 0, 0] * n[:, 1, 1] - n[:, 0, 1] * n[:, 1, 0]
    turn = np.where(np.abs(turn) < np.sin(FLATTEST), np.copysign(np.sin(FLATTEST), turn), turn)[:, None, None]
    a, b = (across * seen.half[:, :1])[:, :, None], (across * seen.half[:, 1:])[:, None, :]
    x = (a * n[:, 1, 1, None, None] - b * n[:, 0, 1, None, None]) / turn
    y = (b * n[:, 0, 0, None, None] - a * n[:, 1, 0, None, None]) / turn
    return beside, seen.place[:, None, None] + np.stack((x, y), axis=-1)


def by_surface(seen: Strands, surface: Look, depth: Floats, radius: Floats) -> tuple[Floats, Floats]:
    """How far in front of the second strand's surface the first one's is, and of which of them the surface there is.

    The surface of each strand is measured beyond the overlap on both sides and carried on across it by a parabola; the
    upper strand's is what is then measured in the overlap. Readings a thickness nearer or farther than the strand's others are of
    something else.

    Parameters
    ----------
    surface : places (..., 2) in the view -> distance (...) of the object's surface, NaN where there is none.
    depth, radius : (C, 2) distance of the strands' axes at the crossing, and their radius in the same unit.

    Returns
    -------
    (C,) distances: second less first, and how much farther from what was measured the second is than the first. NaN where
    one of the strands, or the overlap, was not measured.
    """
    beside, inside = over(seen, np.array(MIDDLE))
    found = _medians(surface(beside))
    above = seen.depth - found
    with np.errstate(invalid="ignore"):
        own = np.abs(above - _medians(above)[..., None]) < 2 * radius[..., None]
    carried = _carried(seen.along, np.where(own, found, np.nan))
    there = _medians(surface(inside).reshape(len(inside), -1))
    known = np.where(np.isfinite(carried), carried, depth - radius)
    miss = np.abs(there[:, None] - known)
    return carried[:, 1] - carried[:, 0], miss[:, 1] - miss[:, 0]


def _medians(values: Floats) -> Floats:
    """Medians over the last axis of what is not NaN there; NaN where all are."""
    ordered = np.sort(values, axis=-1)
    count = np.isfinite(ordered).sum(axis=-1)
    low, high = np.maximum(count - 1, 0) // 2, np.maximum(count, 1) // 2
    pick = np.stack((low, np.where(count > 0, high, 0)), axis=-1)
    return np.asarray(np.take_along_axis(ordered, pick, axis=-1).mean(axis=-1))


def _carried(along: Floats, values: Floats) -> Floats:
    """The parabola through values (..., S) at places (..., S), at place 0: (...); NaN with too few on either side."""
    good = np.isfinite(values)
    scale = along / np.abs(along).max(axis=-1, keepdims=True)
    powers = np.stack((np.ones_like(scale), scale, scale**2), axis=-1)
    for _ in range(2):
        known = np.where(good, values, 0.0)
        weighted = powers * good[..., None]
        square = np.einsum("...si,...sj->...ij", weighted, powers) + 1e-6 * np.eye(3)
        fit = np.linalg.solve(square, np.einsum("...si,...s->...i", weighted, known)[..., None])[..., 0]
        gap = np.where(good, np.abs(np.einsum("...si,...i->...s", powers, fit) - known), np.nan)
        good = good & (gap <= 3 * np.maximum(_medians(gap), 1e-9)[..., None])
    enough = (good.sum(axis=-1) >= LEAST) & (good & (along < 0)).any(axis=-1) & (good & (along > 0)).any(axis=-1)
    return np.where(enough, fit[..., 0], np.nan)


def by_color(seen: Strands, color: Look, noise: float) -> Floats:
    """How much better the first strand's colours beyond the overlap tell those in it than the second's do: (C,) log ratios.

    The upper strand's profile across goes on through the overlap: its middle, its darker sides and its highlight, whatever
    the colour of both. NaN where a strand is not seen on both sides.

    color : places (..., 2) in the view -> colours (..., K), NaN outside the image. noise : of the colours, in their unit.
    """
    beside, inside = over(seen, ACROSS)
    shades, there = color(beside), color(inside)
    sides = np.split(np.moveaxis(shades, 2, -1), 2, axis=-1)
    known = [np.isfinite(part).all(axis=(2, 3)).sum(axis=2) for part in sides]
    profile = (_medians(sides[0]) + _medians(sides[1])) / 2
    error = [((told - there) ** 2).mean(axis=(1, 2, 3)) for told in (profile[:, 0][:, :, None], profile[:, 1][:, None])]
    with np.errstate(invalid="ignore"):
        ratio = np.log((error[1] + noise**2) / (error[0] + noise**2))
    return np.where((np.minimum(*known) >= LEAST // 2).all(axis=1), ratio, np.nan)
