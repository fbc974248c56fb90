"""From the paths on the seen surface to chains along the axis, in three steps: ends, center line, equal segments."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ..config import RefineConfig
from ..geometry.curves import Curves
from ..geometry.equal_segments import chains_along
from ..geometry.polyline import arc_length
from ..geometry.radii import OWN_RADII
from ..kernels import nearest
from ..scene.axis_in_cloud import shows_half_shells
from ..scene.cross_sections import thinned
from ..scene.point_visibility import PointVisibility
from ..scene.samples import Samples, sample_paths
from ..scene.scene import Scene
from ..types import Bools, Chain, Connection, Floats, Ints, Path
from ..types.stopwatch import timed
from .end_extension import SurfaceAhead, extend_to_surface, surface_ahead

WALL_LATERAL_RADII = 0.9
"""Radii from the axis at which surface is the wall of a cylinder and not its end."""

STRIP_LATERAL_RADII, STRIP_LENGTH_RADII = 1.2, 3.0
"""Half-width and length, in radii, of the strip at an end in an image whose area is compared with that of a flat end."""


def refine(paths: Sequence[Path], surface: Floats, scene: Scene, length: float) -> tuple[list[Chain], Scene]:
    """Turn paths on the seen surface into chains of equal segments along the axes of the objects.

    Parameters
    ----------
    paths
        polylines on the seen surface (in 2-D in the mask), one per object, m (px in 2-D).
    surface
        (M, D) m (px in 2-D), the seen surface: the centroids of the voxels.
    scene
        what was captured, with the settings.
    length
        of the segments of the paths, m (px in 2-D).

    Returns
    -------
    chains : longest first.
    scene : with the position of the sensor, where the points of a cloud reveal it.
    """
    if len(scene.each_layer) > 1:
        layer = scene.layer_of(Curves.of([path.points for path in paths], [path.closed for path in paths]))
        own = [[paths[k] for k in np.flatnonzero(layer == number).tolist()] for number in range(len(scene.each_layer))]
        layers = zip(own, scene.each_layer, strict=True)
        found = [chain for some, part in layers for chain in refine(some, part.points, part, length)[0]]
        return sorted(found, key=lambda chain: -chain.length), scene
    extended = extend_ends(paths, scene, length)
    scene = decide_viewpoint(extended, scene, length)
    samples = estimate_centerline(extended, scene, length, scene.config.refine)
    return lay_chains(samples, extended, surface, scene, scene.config.refine), scene


@timed("extend_ends")
def extend_ends(paths: Sequence[Path], scene: Scene, length: float) -> list[Path]:
    """Extend the free ends of paths to where the object's surface ends. Rings are not changed.

    Parameters
    ----------
    paths
        polylines on the seen surface (in 2-D in the mask), one per object, m (px in 2-D).
    scene
        what was captured.
    length
        of the segments, m (px in 2-D).

    Returns
    -------
    The extended polylines in the same order; empty if there are no paths.
    """
    if not paths:
        return []
    samples = sample_paths(paths, scene.radius, length)
    return extend_to_surface(paths, samples, scene.points, scene.point_gap)


@timed("extend_ends")
def decide_viewpoint(paths: Sequence[Path], scene: Scene, length: float) -> Scene:
    """Return the scene with a viewpoint (position of the sensor) inferred for a cloud that has none.

    The viewpoint is set to the origin if the points look like half shells (the half of a cylinder that one camera sees) seen from
    the origin. If they do not, it stays None. A viewpoint that is known stays, and so does everything in 2-D.

    Parameters
    ----------
    paths
        polylines on the seen surface, one per object, m. Without paths the scene is returned unchanged.
    scene
        what was captured.
    length
        of the segments, m (px in 2-D).
    """
    if not (paths and scene.lacks_viewpoint):
        return scene
    samples = sample_paths(paths, scene.radius, length)
    return scene.seen_from(np.zeros(3)) if shows_half_shells(scene.points, samples) else scene


@timed("estimate_centerline")
def estimate_centerline(paths: Sequence[Path], scene: Scene, length: float, config: RefineConfig) -> Samples | None:
    """Estimate the axis and the radius of each object, starting from its path on the seen surface.

    Radius and axis are measured, by the first of these that the data has:

    - a mask: its width gives the radius, the middle between its sides the lateral position, the depth (in 3-D) the rest;
    - camera views of a fused cloud: the masks of all views together, and circles fitted to the cross-sections of the cloud;
    - a viewpoint: the spread of the points across the object gives the radius and the middle, their depth the rest;
    - points alone: circles fitted to the cross-sections.

    Parameters
    ----------
    paths
        polylines on the seen surface, one per object, m (px in 2-D).
    scene
        what was captured.
    length
        of the segments, m (px in 2-D).
    config
        section `refine` of the settings: the number of iterations; 0 leaves the samples on the paths, with `scene.radius`.

    Returns
    -------
    Samples on the axes, about 0.5 radii apart or less along each path, with the radius at each, m (px in 2-D); None if there are
    no paths.
    """
    if not paths:
        return None
    samples = sample_paths(paths, scene.radius, length)
    return scene.measure_axis(samples, config.iterations)


@timed("lay_chains")
def lay_chains(
    samples: Samples | None, paths: Sequence[Path], surface: Floats, scene: Scene, config: RefineConfig
) -> list[Chain]:
    """Lay chains of equal segments along the axis of each object, from end to end.

    Parameters
    ----------
    samples
        samples on the axes of all objects, with radii; None if there are no objects.
    paths
        the polyline of each object that was sampled, in the same order; its connections are transferred to the chain.
    surface
        (M, D) m (px in 2-D), the seen surface: the centroids of the voxels.
    scene
        what was captured.
    config
        section `refine` of the settings: which segments count as occluded, and how thin a chain may be.

    Returns
    -------
    The chains, longest first, with radii, occluded and depth-filled segments, and connections. A chain starts at the end nearer
    the left edge of the image (ties: nearer the top); without a camera, at the end with the smaller x (ties: smaller y). Objects
    shorter than half a segment, and rings of fewer than three segments, give no chain.
    """
    if samples is None:
        return []
    length = scene.config.fit.length
    ahead = surface_ahead(samples, scene.points, scene.point_gap)
    radius = samples.radius[samples.curves.bounds[:-1]].tolist()
    end_of = _strip_end if samples.curves.points.shape[1] == 2 else _wall_end
    shifts = [0.0 if each is None else end_of(each, radius[p]) for p, both in enumerate(ahead) for each in both or (None, None)]
    joints = chains_along(samples.curves, np.array(shifts), length)
    laid = np.flatnonzero(joints.counts).tolist()
    if not laid:
        return []
    at_joint, at_middle, occluded = _seen_along(joints, samples, surface, scene, config.occluded)
    whole = joints if len(laid) == len(joints) else joints.of_numbers(laid)
    filled = scene.depth_support(whole, [radius[p] for p in laid]).is_filled
    is_reversed = _are_reversed(whole, scene)
    chains = []
    for k, p in enumerate(laid):
        part, order = slice(*joints.segment_bounds[p : p + 2]), -1 if is_reversed[k] else 1
        chains.append(
            Chain(
                joints[p][::order],
                length,
                radius[p],
                samples.radii[at_joint[joints.parts[p]]][::order],
                occluded[part][::order],
                bool(joints.closed[p]),
                _connections(paths[p], at_middle[part] - samples.curves.bounds[p], samples.curves.parts[p], order),
                depth_filled=filled[slice(*whole.segment_bounds[k : k + 2])][::order],
            )
        )
    chains.sort(key=lambda chain: -chain.length)
    thickest = np.maximum.accumulate([chain.radius for chain in chains])  # of those as long: an arm beside a wire is shorter
    return [chain for chain, most in zip(chains, thickest, strict=True) if chain.radius >= config.min_radius_ratio * most]


def _wall_end(ahead: SurfaceAhead, radius: float) -> float:
    """Return how far ahead of the last sample the axis ends, m: where the surface stops being a radius away from it.

    That is the end of a flat end; a round one ends less than half a radius beyond the middle of its ball.
    """
    wall = ahead.axial[ahead.lateral > WALL_LATERAL_RADII * radius]
    return float(wall[-min(3, len(wall))]) if len(wall) else 0.0


def _strip_end(ahead: SurfaceAhead, radius: float) -> float:
    """Return how far ahead of the last sample a flat end would cut the strip so that its area is the same, px."""
    back = STRIP_LENGTH_RADII * radius
    count = int(((ahead.axial > -back) & (ahead.lateral < STRIP_LATERAL_RADII * radius)).sum())
    return count / (2 * radius) - back if count else 0.0


def _nearest_of_own(points: Floats, bounds: Ints, curves: Curves) -> Ints:
    """Return the sample nearest to each of N points, (N,); points[bounds[c]:bounds[c + 1]] are compared with those of curve c."""
    index = np.zeros(len(points), dtype=np.int64)
    for own, (first, last) in zip(curves.parts, itertools.pairwise(bounds.tolist()), strict=True):
        index[first:last] = own.start + nearest(points[first:last], curves.points[own], math.inf)[1]
    return index


def _seen_along(joints: Curves, samples: Samples, surface: Floats, scene: Scene, how: str) -> tuple[Ints, Ints, Bools]:
    """Return the sample nearest to each joint and to the middle of each segment, and which segments are occluded.

    joints : of each path, those of the chain laid along it; none for a path without a chain. Occluded is a segment by Keipour et
    al. (RA-L 2022), section III-H.
    """
    curves = samples.curves
    middle = (joints.points[joints.segments] + joints.points[joints.segments + 1]) / 2
    at_joint = _nearest_of_own(joints.points, joints.bounds, curves)
    at_middle = _nearest_of_own(middle, joints.segment_bounds, curves)
    occluded = np.ones(len(middle), dtype=bool)
    if how != "from_depth":
        occluded = samples.filled[at_middle]
    if how != "from_gaps" and occluded.any():
        reach = OWN_RADII * samples.radius[at_middle[occluded]] + scene.voxel
        surface, at = thinned(surface), middle[occluded]
        in_box = (surface >= at.min(axis=0) - reach.max()) & (surface <= at.max(axis=0) + reach.max())
        unseen = ~(nearest(at, surface[in_box.all(axis=1)], float(reach.max()))[0] <= reach)
        unseen &= scene.classify(middle[occluded]) != PointVisibility.MASKED
        occluded[occluded] = unseen
    return at_joint, at_middle, occluded


def _connections(path: Path, near: Ints, samples: slice, order: int) -> tuple[Connection, ...]:
    """Return the connections of a path at the segments that lie there.

    near : (N,), the sample of the path, its first being 0, that is nearest to the middle of each segment. samples : those of the
    path. order : -1 if the chain runs against the path, else 1.
    """
    if not path.joins:
        return ()
    count = samples.stop - samples.start
    along = arc_length(np.concatenate((path.points, path.points[:1])) if path.closed else path.points)
    connections = []
    for step, confidence in path.joins:
        sample = (along[step] + along[step + 1]) / 2 / along[-1] * (count - (not path.closed))
        distance = np.abs(near - sample)
        distance = np.minimum(distance, count - distance) if path.closed else distance
        connections.append(Connection(int(distance.argmin()), confidence))
    if order == 1:
        return tuple(sorted(connections))
    return tuple(Connection(len(near) - 1 - segment, confidence) for segment, confidence in sorted(connections)[::-1])


def _are_reversed(chains: Curves, scene: Scene) -> Bools:
    """Return which chains do not start at the end nearer the left edge of the view (ties: nearer the top)."""
    inwards = np.repeat(chains.closed, 2) * np.tile((1, -1), len(chains))
    ends = scene.in_image(chains.points[chains.tips + inwards])
    (u, v), (last_u, last_v) = ends[::2].T, ends[1::2].T
    return np.asarray(~((u < last_u) | ((u == last_u) & (v <= last_v))))
