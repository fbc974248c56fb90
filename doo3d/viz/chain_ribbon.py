"""One chain as it is drawn: a ribbon as wide as the object, its centre line with the joints, and its two ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..types import Bools, Chain, Crossing, Floats
from .backdrop import Backdrop
from .canvas import Canvas
from .palette import DARK, LIGHT, Rgb

_SEEN, _HIDDEN, _EDGE = 0.50, 0.18, 0.66  # how opaque: ribbon, ribbon where occluded, dark edge
_DASH = (7.0, 7.0)  # px at unit size: drawn, left out


@dataclass(frozen=True)
class Strand:
    """A chain on the image.

    points : (N + 1, 2) px. half : (N + 1,) px, half the width. away : (N + 1,) distance from the image.
    radius : the chain's own, in the unit of the distances. hidden : (N,) bool. unit : px, what line widths are measured in.
    """

    points: Floats
    half: Floats
    away: Floats
    radius: float
    hidden: Bools
    color: Rgb
    closed: bool
    unit: float

    @staticmethod
    def of(chain: Chain, backdrop: Backdrop, color: Rgb, unit: float) -> Strand:
        """Return the chain as it lies on the backdrop."""
        view = backdrop.projection
        distance = view.distance(chain.joints)
        radii = np.where(np.isfinite(chain.radii), chain.radii, 0.0)
        half = np.maximum(radii * view.scale(distance), 0.5 * unit)
        points = view.project(chain.joints)
        radius = chain.radius if np.isfinite(chain.radius) else 0.0
        return Strand(points, half, distance, radius, chain.occluded, color, chain.closed, unit)

    def runs(self, chosen: Bools) -> Iterator[slice]:
        """The stretches of segments that are chosen, on the image, and alike in being hidden; as slices of joints."""
        seen = np.asarray(np.isfinite(self.points).all(axis=1))
        good = chosen & seen[1:] & seen[:-1]
        start = 0
        for i in range(1, len(good) + 1):
            if i == len(good) or good[i] != good[start] or self.hidden[i] != self.hidden[start]:
                if good[start]:
                    yield slice(start, i + 1)
                start = i

    def paint(self, canvas: Canvas, chosen: Bools, joints: bool = True) -> None:
        """Draw the chosen segments ((N,) bool): ribbon, edge, centre line."""
        runs = list(self.runs(chosen))
        for run in runs:
            if not self.hidden[run.start]:
                self._ribbon(canvas, run, 1.5 * self.unit, DARK, _EDGE)
        for run in runs:
            self._ribbon(canvas, run, 0.0, self.color, _HIDDEN if self.hidden[run.start] else _SEEN)
        for run in runs:
            self._center(canvas, run)
        if joints:
            for run in runs:
                self._joints(canvas, run)

    def _ribbon(self, canvas: Canvas, run: slice, more: float, color: Rgb, alpha: float) -> None:
        points, half = self.points[run], self.half[run] + more
        along = np.diff(points, axis=0)
        across = np.column_stack((-along[:, 1], along[:, 0]))
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
        for i, side in enumerate(across):
            a, b = side * half[i], side * half[i + 1]
            canvas.polygon(np.array([points[i] + a, points[i + 1] + b, points[i + 1] - b, points[i] - a]), color, alpha)
        for point, radius in zip(points[1:-1], half[1:-1], strict=True):
            canvas.disc(point, radius, color, alpha)

    def _center(self, canvas: Canvas, run: slice) -> None:
        points = self.points[run]
        if self.hidden[run.start]:
            dark = bright = _dashes(points, self.unit)
        else:
            dark, bright = [points], [self._into_neighbours(run)]
        for piece in dark:
            canvas.line(piece, DARK, 0.7, 3.4 * self.unit)
        for piece in bright:
            canvas.line(piece, self.color, 1.0, 2.0 * self.unit)

    def _into_neighbours(self, run: slice) -> Floats:
        """The points of a run and half a segment more on both sides, so that no dark cap shows where runs meet."""
        points = [self.points[run]]
        for joint, beyond in ((run.start, run.start - 1), (run.stop - 1, run.stop)):
            if 0 <= beyond < len(self.points) and not self.hidden[min(joint, beyond)]:
                middle = (self.points[joint] + self.points[beyond])[None] / 2
                points = [middle, *points] if beyond < joint else [*points, middle]
        whole = np.concatenate(points)
        return np.asarray(whole[np.isfinite(whole).all(axis=1)])

    def _joints(self, canvas: Canvas, run: slice) -> None:
        points = self.points[run]
        spacing = float(np.median(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        radius = min(1.4 * self.unit, 0.12 * spacing)
        if radius < 0.5 * self.unit or self.hidden[run.start]:
            return
        for point in points:
            canvas.disc(point, radius, LIGHT, 1.0)

    def bridge(self, canvas: Canvas, chosen: Bools) -> None:
        """Lines along both sides of the chosen segments, as maps draw a bridge: this strand passes over another."""
        for run in self.runs(chosen):
            points = self.points[run]
            across = np.gradient(points, axis=0)[:, ::-1] * (-1, 1)
            across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9)
            for side in (-1, 1):
                edge = points + side * across * (self.half[run] + 1.5 * self.unit)[:, None]
                canvas.line(edge, DARK, 0.9, 3.6 * self.unit)
                canvas.line(edge, LIGHT, 1.0, 1.6 * self.unit)

    def ends(self, canvas: Canvas) -> None:
        """Mark the first joint with a disc and the last with a ring; a closed chain has the disc alone."""
        first, last, u = self.points[0], self.points[-1], self.unit
        if np.isfinite(last).all() and not self.closed:
            canvas.disc(last, 8.2 * u, DARK, 0.85)
            canvas.disc(last, 7.0 * u, LIGHT, 1.0)
            canvas.disc(last, 6.0 * u, self.color, 1.0)
            canvas.disc(last, 3.6 * u, DARK, 0.85)
            canvas.disc(last, 2.8 * u, DARK, 0.0)
        if np.isfinite(first).all():
            canvas.disc(first, 8.2 * u, DARK, 0.85)
            canvas.disc(first, 7.0 * u, LIGHT, 1.0)
            canvas.disc(first, 5.6 * u, self.color, 1.0)


def _dashes(points: Floats, unit: float) -> list[Floats]:
    """The line through the points cut into dashes, the same at both ends."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    at = np.concatenate(([0.0], np.cumsum(steps)))
    drawn, left = _DASH[0] * unit, _DASH[1] * unit
    count = max(1, round((at[-1] + left) / (drawn + left)))
    stretch = at[-1] / (count * drawn + (count - 1) * left) if at[-1] > 0 else 1.0
    pieces: list[Floats] = []
    for i in range(count):
        begin = i * (drawn + left) * stretch
        end = begin + drawn * stretch
        inner = at[(at > begin) & (at < end)]
        where = np.concatenate(([begin], inner, [end]))
        pieces.append(np.column_stack([np.interp(where, at, points[:, k]) for k in range(2)]))
    return pieces


def bridges(strands: list[Strand], crossings: Sequence[Crossing]) -> list[tuple[int, Bools, bool]]:
    """The pieces of strands that pass over others: strand, (N,) bool of its segments, whether that is known; far ones first.

    crossings : as detected; without any, of two strands that touch in the view the nearer one passes over.
    """
    if not crossings:
        return [(index, chosen, False) for index, chosen, _ in _nearer(strands)]
    pieces = []
    for crossing in crossings:
        upper, lower = strands[crossing.upper.chain], strands[crossing.lower.chain]
        at, under = crossing.upper.segment, crossing.lower.segment
        middle = (upper.points[1:] + upper.points[:-1]) / 2
        step, other = upper.points[at + 1] - upper.points[at], lower.points[under + 1] - lower.points[under]
        size = np.linalg.norm(step) * np.linalg.norm(other)
        sine = max(abs(step[0] * other[1] - step[1] * other[0]) / max(size, 1e-9), 0.4)
        reach = (lower.half[under] + 0.7 * upper.half[at]) / sine + np.linalg.norm(step) / 2
        near = np.linalg.norm(middle - middle[at], axis=1) <= reach
        chosen = np.zeros_like(near)
        start, stop = next((start, stop) for start, stop in _stretches(near) if start <= at < stop)
        chosen[start:stop] = True
        if not upper.hidden[at]:
            pieces.append((crossing.upper.chain, chosen, crossing.confidence > 0, float(upper.away[at])))
    return [(index, chosen, known) for index, chosen, known, _ in sorted(pieces, key=lambda piece: -piece[3])]


def _nearer(strands: list[Strand]) -> list[tuple[int, Bools, float]]:
    """The pieces of strands that lie nearer than what they touch: strand, (N,) bool, their distance; far ones first."""
    middle = [(strand.points[1:] + strand.points[:-1]) / 2 for strand in strands]
    away = [(strand.away[1:] + strand.away[:-1]) / 2 for strand in strands]
    reach = [
        np.linalg.norm(np.diff(strand.points, axis=0), axis=1) / 2 + np.maximum(strand.half[1:], strand.half[:-1])
        for strand in strands
    ]
    pieces: list[tuple[int, Bools, float]] = []
    for a, strand in enumerate(strands):
        over = np.zeros(len(strand.hidden), dtype=bool)
        for b, other in enumerate(strands):
            gap = np.linalg.norm(middle[a][:, None] - middle[b][None], axis=2)
            close = gap < reach[a][:, None] + reach[b][None]
            # nearer by more than a radius: strands that lie side by side are no crossing
            nearer = away[a][:, None] < away[b][None] - min(strand.radius, other.radius)
            over |= np.asarray((close & nearer).any(axis=1))
        for start, stop in _stretches(over & ~strand.hidden):
            chosen = np.zeros_like(over)
            chosen[start:stop] = True
            pieces.append((a, chosen, float(away[a][start:stop].mean())))
    return sorted(pieces, key=lambda piece: -piece[2])


def _stretches(chosen: Bools) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], chosen, [False])).astype(int)))
    return [(int(start), int(stop)) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
