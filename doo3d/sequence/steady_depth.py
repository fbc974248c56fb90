"""Smooth the depth of an object over the frames of a capture that show as much of it.

A stereo camera measures where a strand is in the image to a fraction of a pixel, and how far away it is with errors in waves of
many radii along the strand, which no single frame can tell from bends. From frame to frame these waves change, while the bends
of the object change smoothly. So its inverse range is smoothed over time and along the object together: mostly the change over
time of its bends, by the share of noise in it. How fast bends change is known across the line of sight, where the image measures
well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import interp1d
from scipy.linalg import solveh_banded

from ..config import TrackingConfig
from ..geometry.noise import MAD_TO_DEVIATION
from ..geometry.polyline import unit
from ..types import Bools, Chain, Floats, Ints
from .image_tracks import image_tracks, is_of_camera, laid, turned_by
from .observations import Observation, ObservedStrand
from .tracking import reversed_chain
from .tracks import MIN_FRAMES, WINDOW

NODES = 40
"""Places along an object at which its depth is smoothed: about as far apart as the waves are long that a stereo camera adds."""

ALIKE = 0.1
"""Share by which the length of an object in the image may change from one frame to the next that shows it: if it changes more, an
occluder came or went. Within stretches without such changes, equal shares of the length are the same places of the object."""

AROUND, SEEN_ERROR = 4, 0.03
"""Frames on either side, and share by which the length of an object in the image may differ from its median over them: the image
tells better than depth whether an end is hidden."""

UNSEEN_WEIGHT = 0.02
"""Weight of depth that no reading supports, beside 1."""

BEND_SHARE = 0.04
"""Weight of the bends and of the acceleration of an object, beside 1 for the change over time of its bends: both are large where
it is bent away from the camera, or pushed. Of 1,320 frames before stereo cameras 792 are right, 1,198 in the image; with 0.01 778
and 1,184, with 0.16 783 and 1,196."""

OUTLIER_DEVIATIONS, ROUNDS = 2.0, 5
"""Standard deviations at which a reading weighs a quarter (Geman and McClure's estimator), and rounds of weighing."""

LEAST_VARIANCE = 1e-10
"""Least variance of relative inverse range and of its changes: depth of rendered scenes can be without noise."""


def steadied(observations: Sequence[Observation], tracking: TrackingConfig) -> list[Observation]:
    """Return observations whose chains and strands have their depth smoothed over time, where frames show as much of an object.

    Chains are tracked in the image, where what depth says of their lengths is of no matter.

    Parameters
    ----------
    observations
        frames in order, of one camera, in its frame; of clouds, which have no line of sight, they are returned as they are.
    tracking
        how a chain is recognized from frame to frame.
    """
    result = list(observations)
    if not is_of_camera(observations):
        return result
    for track in image_tracks(observations, tracking).values():
        for items in _stretches(track.items):
            seen = [
                reversed_chain(observations[frame].detection.chains[number], track.backwards[frame])[0]
                for frame, number, _ in items
            ]
            steady = steady_chains([frame for frame, _, _ in items], seen)
            for (frame, number, _), chain in zip(items, steady, strict=True):
                own = reversed_chain(chain, track.backwards[frame])[0]
                result[frame] = _with_chain(result[frame], number, own)
    return result


def _stretches(items: Sequence[tuple[int, int, Chain]]) -> list[Sequence[tuple[int, int, Chain]]]:
    """Return the items of a track, in the image, in stretches of one WINDOW each that show as much of the object."""
    starts = [
        number
        for number, (last, item) in enumerate(pairwise(items), 1)
        if item[0] // WINDOW != last[0] // WINDOW or abs(item[2].length - last[2].length) > ALIKE * last[2].length
    ]
    return [items[first:end] for first, end in pairwise([0, *starts, len(items)])]


def _with_chain(observation: Observation, number: int, chain: Chain) -> Observation:
    """Return an observation with another chain of as many segments in place of one, and its strands on the joints of that."""
    detection = observation.detection
    before = detection.chains[number]
    chains = (*detection.chains[:number], chain, *detection.chains[number + 1 :])
    strands = (_moved(each, before, chain) if each.chain == number else each for each in observation.strands)
    return replace(observation, detection=replace(detection, chains=chains), strands=tuple(strands))


def _moved(strand: ObservedStrand, before: Chain, chain: Chain) -> ObservedStrand:
    """Return a strand on the same joints of another chain of as many segments."""
    start = int(np.argmin(np.linalg.norm(before.joints - strand.points[0], axis=1)))
    at = start + np.rint((strand.arcs - strand.arcs[0]) / before.segment_length).astype(np.int64)
    share = chain.segment_length / before.segment_length
    return replace(strand, points=chain.joints[at], arcs=strand.arcs * share, length=strand.length * share)


def steady_chains(frames: Sequence[int], chains: Sequence[Chain]) -> list[Chain]:
    """Return the chains of one object with their depth smoothed over time; what is across the line of sight stays.

    Parameters
    ----------
    frames
        the index in the capture of the frame of each chain, ascending.
    chains
        the chains, each the whole object or nearly so, in one direction and in the camera's frame. Fewer than MIN_FRAMES (3) are
        returned as they are, and so is a chain that is shorter or longer in the image than those around it.

    Returns
    -------
    Chains of as many segments each, of equal length again.
    """
    turned = [turned_by(chain.joints) for chain in chains]
    angle = np.array([angles[-1] for angles in turned])
    usual = np.array([np.median(angle[max(0, k - AROUND) : k + AROUND + 1]) for k in range(len(chains))])
    whole = np.flatnonzero(np.abs(angle - usual) <= SEEN_ERROR * usual).tolist()
    if len(whole) < MIN_FRAMES:
        return list(chains)
    at = np.array([frames[k] for k in whole]) - frames[whole[0]]
    given = [chains[k] for k in whole]
    in_image = [turned[k] for k in whole]
    rays = _at_places(at, in_image, [unit(chain.joints) for chain in given])
    lines = _steady_lines(at, given, in_image, rays)
    result = list(chains)
    for k, line in zip(whole, lines, strict=True):
        result[k] = laid(chains[k], line, chains[k].radius)
    return result


def _steady_lines(at: Ints, chains: Sequence[Chain], arcs: Sequence[Floats], rays: Floats) -> list[Floats]:
    """Return the joints of chains with their depth smoothed over time at evenly spaced places along them.

    at : (N,) the frames of the chains, ascending from 0. arcs : for each chain where its joints are along it, in any unit.
    rays : (T, NODES, 3), directions from the camera to the chains, which tell how they bend across the line of sight.
    """
    distances = [np.linalg.norm(chain.joints, axis=1) for chain in chains]
    weights = [np.where(_is_seen(chain), 1.0, UNSEEN_WEIGHT) for chain in chains]
    known = [np.column_stack((1 / distance, weight)) for distance, weight in zip(distances, weights, strict=True)]
    inverse, weight = np.moveaxis(np.nan_to_num(_at_places(at, arcs, known)), 2, 0)
    change = smooth_in_time(inverse, weight, rays) - inverse
    nearer = [
        distance * np.interp(arc / arc[-1], np.linspace(0.0, 1.0, NODES), change[row])
        for row, arc, distance in zip(at.tolist(), arcs, distances, strict=True)
    ]
    return [chain.joints / (1 + each)[:, None] for chain, each in zip(chains, nearer, strict=True)]


def _at_places(at: Ints, arcs: Sequence[Floats], values: Sequence[Floats]) -> Floats:
    """Return values (M, C) of the joints of chains at evenly spaced places along them: (T, NODES, C), NaN in other frames."""
    result = np.full((at[-1] + 1, NODES, values[0].shape[1]), np.nan)
    places = np.linspace(0.0, 1.0, NODES)
    for row, arc, each in zip(at.tolist(), arcs, values, strict=True):
        share = arc / arc[-1]
        low = np.clip(share.searchsorted(places), 1, len(arc) - 1) - 1
        slope = (each[low + 1] - each[low]) / (share[low + 1] - share[low])[:, None]
        result[row] = slope * (places - share[low])[:, None] + each[low]
    return result


def _is_seen(chain: Chain) -> Bools:
    """Tell which joints of a chain bound a segment whose depth was measured: (M + 1,)."""
    return np.asarray(np.append(~chain.depth_filled, False) | np.append(False, ~chain.depth_filled))


def steady_shapes(joints: Floats, seen: Bools) -> Floats:
    """Return the joints (T, M + 1, 3) m of an object in successive frames with their depth smoothed over time.

    seen : (T, M + 1) bool, which joints the frames show.
    """
    if len(joints) < MIN_FRAMES:
        return joints
    distance = np.linalg.norm(joints, axis=2)
    places, at = np.linspace(0.0, 1.0, NODES), np.linspace(0.0, 1.0, joints.shape[1])
    values = np.dstack((1 / distance, np.where(seen, 1.0, UNSEEN_WEIGHT), joints / distance[:, :, None]))
    inverse, weight, *rays = np.moveaxis(interp1d(at, values, axis=1)(places), 2, 0)
    change = smooth_in_time(inverse, weight, np.stack(rays, axis=2)) - inverse
    nearer = distance * interp1d(places, change, axis=1)(at)
    return np.asarray(joints / (1 + nearer)[:, :, None])


def smooth_in_time(inverse: Floats, weight: Floats, rays: Floats) -> Floats:
    """Smooth the inverse range of places along an object over time.

    Parameters
    ----------
    inverse
        (T, K) 1/m, inverse range of K >= 3 evenly spaced places in T >= 3 frames.
    weight
        (T, K), 0 where it is not known.
    rays
        (T, K, 3) unit, direction from the camera to each place; NaN where it is not known.

    Returns
    -------
    (T, K) 1/m, known everywhere; the given values where bends change no more along the line of sight than across it.

    Notes
    -----
    The result x minimizes the sum of w (x - y)^2 over y, the given values, in shares of their median, plus
    n |D_t D_k x|^2 / b^2 + BEND_SHARE (n |D_k x|^2 / k^2 + n |D_t x|^2 / t^2), where D_k and D_t are second differences along
    the object and over time, b, k and t the robust standard deviations of these differences across the line of sight, and n the
    variance of the noise, from how much more D_t D_k y and D_t y vary. Weights w fall with the misfit (Geman and McClure).
    """
    known = weight > 0
    scale = float(np.median(inverse[known]))
    values = np.where(known, inverse / scale, np.nan)
    tangent = np.gradient(rays, axis=1)
    across = np.cross(rays, tangent)
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), LEAST_VARIANCE)
    over_time, along = np.diff(rays, 2, axis=0), np.diff(rays, 2, axis=1)
    moved = _variance((over_time * across[1:-1]).sum(axis=2))
    bent = _variance((along * across[:, 1:-1]).sum(axis=2))
    bends_moved = _variance((np.diff(along, 2, axis=0) * across[1:-1, 1:-1]).sum(axis=2))
    changed = _variance(np.diff(np.diff(values, 2, axis=1), 2, axis=0))
    if changed <= bends_moved:
        return inverse
    noise = max(changed / 36, (_variance(np.diff(values, 2, axis=0)) - moved) / 6)  # a second difference has 6 times the variance
    stiffness = _stiffness(weight.shape, noise / bends_moved, BEND_SHARE * noise / bent, BEND_SHARE * noise / moved)
    values = np.where(known, values, 0.0)
    smooth, current = values, weight
    for _ in range(ROUNDS):
        bands = stiffness.copy(order="F")
        bands[0] += current.ravel()
        smooth = solveh_banded(bands, (current * values).ravel(), overwrite_ab=True, lower=True, check_finite=False)
        smooth = smooth.reshape(values.shape)
        off = values - smooth
        limit = OUTLIER_DEVIATIONS**2 * max(noise, _variance(off[known]))
        current = weight / (1 + off**2 / limit) ** 2
    return np.asarray(smooth * scale)


def _variance(values: Floats) -> float:
    """Return the robust variance of values, those that are NaN left out."""
    known = values[np.isfinite(values)]
    return max(float(MAD_TO_DEVIATION * np.median(np.abs(known))) ** 2 if len(known) else 0.0, LEAST_VARIANCE)


def _stiffness(shape: tuple[int, int], both: float, along: float, over_time: float) -> Floats:
    """Return the lower bands of the penalties on second differences for `solveh_banded`: (2 K + 3, T K), diagonal first.

    shape : (T, K) frames and places. both, along, over_time : weights of the differences over time of those along the object, of
    those along it, and of those over time.
    """
    frames, nodes = shape
    bands = np.zeros((frames, nodes, 2 * nodes + 3))
    line, time = _squared_differences(nodes), _squared_differences(frames)
    for later in range(3):
        for farther in range(-2 if later else 0, 3):
            by_place = line[abs(farther)] if farther >= 0 else np.roll(line[-farther], -farther)
            weight = both * np.outer(time[later], by_place)
            if not later:
                weight += along * by_place
            if not farther:
                weight += over_time * time[later][:, None]
            bands[:, :, later * nodes + farther] = weight
    bands[:, :, 0] += LEAST_VARIANCE
    return np.asarray(bands.reshape(frames * nodes, 2 * nodes + 3).T)  # columns in one piece, as LAPACK reads them


def _squared_differences(count: int) -> Floats:
    """Return the diagonals of the matrix whose quadratic form is the sum of squared second differences of N values: (3, N).

    Row k holds for each column the entry k rows below the main diagonal, 0 outside.
    """
    diagonals = np.zeros((3, count))
    for row, entries in enumerate(((1, 4, 1), (-2, -2), (1,))):
        for k, entry in enumerate(entries):
            diagonals[row, k : k + count - 2] += entry
    return diagonals
