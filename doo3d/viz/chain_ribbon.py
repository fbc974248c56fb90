"""Draw a chain: a ribbon of the object's width, the center line with the joints, and marks at both ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.curves import runs
from ..types import Array, Bools, Chain, Crossing, Floats, Ints
from .backdrop import Backdrop
from .canvas import Canvas
from .palette import DARK, LIGHT, ChainStyle, Rgb
from .segment_kinds import DEPTH_FILLED, FROM_TIME, OCCLUDED, SEEN, segment_kinds

VISIBLE_ALPHA, OCCLUDED_ALPHA, EDGE_ALPHA = 0.50, 0.18, 0.66  # opacity of a ribbon, an occluded ribbon, and a ribbon's edge
DASH, DASH_GAP = 7.0, 7.0  # px at unit size
DOT, DOT_GAP = 2.0, 5.0  # px at unit size, of the center line where the depth was filled in
MIN_CROSSING_SINE = 0.4  # flatter crossings are drawn as long as at this angle


@dataclass(frozen=True)
class ChainRibbon:
    """A chain of N segments projected to an image, to be drawn as a ribbon as wide as the object.

    Attributes
    ----------
    points
        (N + 1, 2) px, the joints in the image; NaN for joints behind the camera.
    half_width
        (N + 1,) px, half the width of the ribbon at each joint.
    distance
        (N + 1,) m, distance of each joint along the viewing direction: smaller is nearer. 0 in 2-D.
    radius
        radius of the chain, m (px in 2-D); 0 if unknown.
    occluded
        (N,) bool, whether each segment is occluded.
    kinds
        (N,) int, the kind of each segment, as `segment_kinds` returns it.
    color
        RGB, 0 to 255.
    closed
        whether the chain is a ring, whose last joint meets the first.
    unit
        factor of all line widths: 1 in a small image, more in a large one.
    """

    points: Floats
    half_width: Floats
    distance: Floats
    radius: float
    occluded: Bools
    kinds: Array
    color: Rgb
    closed: bool
    unit: float

    @staticmethod
    def of(chain: Chain, backdrop: Backdrop, style: ChainStyle, unit: float) -> ChainRibbon:
        """Return a chain projected to the image that it will be drawn on.

        Parameters
        ----------
        chain
            the chain, in the coordinates that the projection of `backdrop` takes.
        backdrop
            the image and the projection of points to its pixels.
        style
            its color, and the factor of its widths: a doubtful chain is a thin line, however wide the object.
        unit
            factor of all line widths: 1, or more in a large image.
        """
        unit *= style.width
        view = backdrop.projection
        distance = view.distance(chain.joints)
        radii = np.where(np.isfinite(chain.radii), chain.radii, 0.0)
        half_width = np.maximum(0.0 * distance if style.doubt else radii * view.scale(distance), 0.5 * unit)
        points = view.project(chain.joints)
        radius = chain.radius if np.isfinite(chain.radius) else 0.0
        return ChainRibbon(
            points, half_width, distance, radius, chain.occluded, segment_kinds(chain), style.color, chain.closed, unit
        )

    @property
    def middles(self) -> Floats:
        """The middle of each segment, halfway between its two joints in the image: (N, 2) px."""
        return np.asarray((self.points[1:] + self.points[:-1]) / 2)

    def runs(self, chosen: Bools) -> Iterator[slice]:
        """Yield runs of consecutive chosen segments of the same kind.

        Parameters
        ----------
        chosen
            (N,) bool, for each of the N segments of the chain. Segments with a joint behind the camera are left out.

        Yields
        ------
        slice
            of the joints: `points[run]` are the joints of the run, one more than the run has segments.
        """
        in_view = np.asarray(np.isfinite(self.points).all(axis=1))
        drawable = chosen & in_view[1:] & in_view[:-1]
        start = 0
        for i in range(1, len(drawable) + 1):
            if i == len(drawable) or drawable[i] != drawable[start] or self.kinds[i] != self.kinds[start]:
                if drawable[start]:
                    yield slice(start, i + 1)
                start = i

    def paint(self, canvas: Canvas, chosen: Bools) -> None:
        """Draw the chosen segments: dark edge, ribbon, center line and joints.

        Occluded segments are paler, with a dashed center line, and have neither edge nor joints; between the dashes of those that
        other frames filled in, the line is white. Segments that are seen but whose depth was filled in have a dotted center line
        and no joints.

        Parameters
        ----------
        canvas
            the layer to draw on.
        chosen
            (N,) bool, which of the N segments of the chain to draw.
        """
        runs = list(self.runs(chosen))
        for run in runs:
            if not self.occluded[run.start]:
                self._paint_ribbon(canvas, run, 1.5 * self.unit, DARK, EDGE_ALPHA)
        for run in runs:
            self._paint_ribbon(canvas, run, 0.0, self.color, OCCLUDED_ALPHA if self.occluded[run.start] else VISIBLE_ALPHA)
        for run in runs:
            self._paint_center_line(canvas, run)
        for run in runs:
            self._paint_joints(canvas, run)

    def _paint_ribbon(self, canvas: Canvas, run: slice, margin: float, color: Rgb, alpha: float) -> None:
        canvas.ribbon(self.points[run], self.half_width[run] + margin, color, alpha)

    def _paint_center_line(self, canvas: Canvas, run: slice) -> None:
        points, kind = self.points[run], self.kinds[run.start]
        if kind in (OCCLUDED, FROM_TIME):
            outlines = lines = _dashes(points, DASH * self.unit, DASH_GAP * self.unit)
        elif kind == DEPTH_FILLED:
            outlines = lines = _dashes(points, DOT * self.unit, DOT_GAP * self.unit)
        else:
            outlines, lines = [points], [self._with_neighbors(run)]
        for piece in [points] if kind == FROM_TIME else outlines:
            canvas.line(piece, DARK, 0.7, 3.4 * self.unit)
        if kind == FROM_TIME:
            canvas.line(points, LIGHT, 1.0, 2.0 * self.unit)
        for piece in lines:
            canvas.line(piece, self.color, 1.0, 2.0 * self.unit)

    def _with_neighbors(self, run: slice) -> Floats:
        """Return the points of a run, extended by half a segment on both sides to avoid dark caps between runs."""
        points = [self.points[run]]
        for joint, neighbor in ((run.start, run.start - 1), (run.stop - 1, run.stop)):
            if 0 <= neighbor < len(self.points) and self.kinds[min(joint, neighbor)] == SEEN:
                middle = (self.points[joint] + self.points[neighbor])[None] / 2
                points = [middle, *points] if neighbor < joint else [*points, middle]
        extended = np.concatenate(points)
        return np.asarray(extended[np.isfinite(extended).all(axis=1)])

    def _paint_joints(self, canvas: Canvas, run: slice) -> None:
        points = self.points[run]
        spacing = float(np.median(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        radius = min(1.4 * self.unit, 0.12 * spacing)
        if radius < 0.5 * self.unit or self.kinds[run.start] != SEEN:
            return
        canvas.discs(points, radius, LIGHT, 1.0)

    def paint_bridge_edges(self, canvas: Canvas, chosen: Bools) -> None:
        """Draw a white line along both sides of segments that pass over another chain, like a bridge on a map.

        Parameters
        ----------
        canvas
            the layer to draw on.
        chosen
            (N,) bool, which of the N segments of the chain to mark.
        """
        for run in self.runs(chosen):
            points = self.points[run]
            normals = np.gradient(points, axis=0)[:, ::-1] * (-1, 1)
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
            for side in (-1, 1):
                edge = points + side * normals * (self.half_width[run] + 1.5 * self.unit)[:, None]
                canvas.line(edge, DARK, 0.9, 3.6 * self.unit)
                canvas.line(edge, LIGHT, 1.0, 1.6 * self.unit)

    def paint_ends(self, canvas: Canvas, marked: tuple[bool, bool] = (True, True)) -> None:
        """Mark the first joint with a disc and the last joint with a ring; a closed chain gets only the disc.

        marked : whether the first joint is marked, and the last; ends at junctions are not.
        """
        first, last, u = self.points[0], self.points[-1], self.unit
        if marked[1] and np.isfinite(last).all() and not self.closed:
            canvas.disc(last, 8.2 * u, DARK, 0.85)
            canvas.disc(last, 7.0 * u, LIGHT, 1.0)
            canvas.disc(last, 6.0 * u, self.color, 1.0)
            canvas.disc(last, 3.6 * u, DARK, 0.85)
            canvas.disc(last, 2.8 * u, DARK, 0.0)
        if marked[0] and np.isfinite(first).all():
            canvas.disc(first, 8.2 * u, DARK, 0.85)
            canvas.disc(first, 7.0 * u, LIGHT, 1.0)
            canvas.disc(first, 5.6 * u, self.color, 1.0)


def _dashes(points: Floats, dash: float, gap: float) -> list[Floats]:
    """Cut a polyline (P, 2) px into dashes of about `dash` px, with gaps of `gap` px, from its first to its last point."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    at = np.concatenate(([0.0], np.cumsum(steps)))
    count = max(1, round((at[-1] + gap) / (dash + gap)))
    stretch = at[-1] / (count * dash + (count - 1) * gap) if at[-1] > 0 else 1.0
    dashes: list[Floats] = []
    for i in range(count):
        start = i * (dash + gap) * stretch
        stop = start + dash * stretch
        inner = at[(at > start) & (at < stop)]
        positions = np.concatenate(([start], inner, [stop]))
        dashes.append(np.column_stack([np.interp(positions, at, points[:, k]) for k in range(2)]))
    return dashes


def upper_pieces(strands: list[ChainRibbon], crossings: Sequence[Crossing]) -> list[tuple[int, Bools, bool]]:
    """Return the pieces of chains that pass over another chain, in the order to draw them: far pieces first.

    Parameters
    ----------
    strands
        the projected chains, in the order of the detection.
    crossings
        the crossings of the detection. If there are none, the depth decides: where two chains overlap in the image, the one that
        is nearer by more than a radius passes over.

    Returns
    -------
    list of (int, (N,) bool, bool)
        for each piece: the index of its chain; which of the N segments of this chain belong to the piece; and whether the piece
        is the upper one at a crossing of the detection with a confidence above 0.
    """
    if not crossings:
        return [(index, chosen, False) for index, chosen, _ in _nearer_pieces(strands)]
    pieces = []
    for crossing in crossings:
        upper, lower = strands[crossing.upper.chain], strands[crossing.lower.chain]
        at, below = crossing.upper.segment, crossing.lower.segment
        middles = upper.middles
        step, lower_step = upper.points[at + 1] - upper.points[at], lower.points[below + 1] - lower.points[below]
        size = np.linalg.norm(step) * np.linalg.norm(lower_step)
        sine = max(abs(step[0] * lower_step[1] - step[1] * lower_step[0]) / max(size, 1e-9), MIN_CROSSING_SINE)
        reach = (lower.half_width[below] + 0.7 * upper.half_width[at]) / sine + np.linalg.norm(step) / 2
        near = np.linalg.norm(middles - middles[at], axis=1) <= reach
        chosen = np.zeros_like(near)
        start, stop = next((start, stop) for start, stop in runs(near) if start <= at < stop)
        chosen[start:stop] = True
        if not upper.occluded[at]:
            pieces.append((crossing.upper.chain, chosen, crossing.confidence > 0, float(upper.distance[at])))
    return [(index, chosen, known) for index, chosen, known, _ in sorted(pieces, key=lambda piece: -piece[3])]


def _nearer_pieces(strands: list[ChainRibbon]) -> list[tuple[int, Bools, float]]:
    """Return the pieces nearer than a strand that overlaps them: chain index, (N,) bool, distance; far ones first."""
    middles = [strand.middles for strand in strands]
    distance = [(strand.distance[1:] + strand.distance[:-1]) / 2 for strand in strands]
    reach = [
        np.linalg.norm(np.diff(strand.points, axis=0), axis=1) / 2 + np.maximum(strand.half_width[1:], strand.half_width[:-1])
        for strand in strands
    ]
    reach = [np.nan_to_num(each) for each in reach]  # joints behind the camera
    pieces: list[tuple[int, Bools, float]] = []
    for a, strand in enumerate(strands):
        is_upper = np.zeros(len(strand.occluded), dtype=bool)
        for b, other in enumerate(strands):
            i, j = _pairs_within(middles[a], middles[b], 1.001 * (reach[a].max(initial=0) + reach[b].max(initial=0)))
            touching = np.linalg.norm(middles[a][i] - middles[b][j], axis=1) < reach[a][i] + reach[b][j]
            # nearer by more than a radius: strands side by side do not cross
            nearer = distance[a][i] < distance[b][j] - min(strand.radius, other.radius)
            is_upper[i[touching & nearer]] = True
        for start, stop in runs(is_upper & ~strand.occluded):
            chosen = np.zeros_like(is_upper)
            chosen[start:stop] = True
            pieces.append((a, chosen, float(distance[a][start:stop].mean())))
    return sorted(pieces, key=lambda piece: -piece[2])


def _pairs_within(first: Floats, second: Floats, reach: float) -> tuple[Ints, Ints]:
    """Return the rows of all pairs of points (N, 2) and (M, 2) px within a distance; points with NaN have none."""
    rows = [np.flatnonzero(np.isfinite(points).all(axis=1)) for points in (first, second)]
    if not (len(rows[0]) and len(rows[1]) and np.isfinite(reach)):
        return rows[0][:0], rows[1][:0]
    trees = [cKDTree(points[chosen]) for points, chosen in zip((first, second), rows, strict=True)]
    pairs = trees[0].sparse_distance_matrix(trees[1], reach, output_type="coo_matrix")
    return rows[0][pairs.row], rows[1][pairs.col]
