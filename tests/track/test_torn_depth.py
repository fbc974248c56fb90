"""Depth of a frame that is wrong where most readings are of what lies behind is put right by the readings of all frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from doo3d.config import TrackingConfig
from doo3d.geometry.polyline import arc_length, resample, unit
from doo3d.track.chain_direction import reversed_chain
from doo3d.track.depth_readings import NODES, PER_NODE
from doo3d.track.depth_smoothing import smooth_depth_over_time
from doo3d.track.inverse_range_smoother import smooth_inverse_range
from doo3d.track.observations import Observation
from doo3d.track.registration import exact_lengths
from doo3d.track.torn_depth import correct_torn_depth
from doo3d.types import Chain, Detection

FRAMES, RADIUS, BEHIND = 24, 0.003, 1.4


def lines(still: bool = False) -> np.ndarray:
    """A cable 0.9 m long about 0.9 m before the camera, leaning away from it, that swings: (FRAMES, NODES, 3) m, even as seen."""
    arc = np.linspace(-0.45, 0.45, 200)
    result = []
    for frame in range(FRAMES):
        turn = 0.3 if still else 0.3 + 0.02 * frame
        angle = 1.2 * arc
        x, y = np.sin(angle) / 1.2, (1 - np.cos(angle)) / 1.2
        line = np.column_stack((x, y * np.cos(turn) - 0.1, 0.85 + y * np.sin(turn) + 0.3 * x))
        turned = arc_length(unit(line))
        at = np.linspace(0.0, turned[-1], NODES)
        result.append(np.column_stack([np.interp(at, turned, column) for column in line.T]))
    return np.array(result)


def readings_of(ranges: np.ndarray, right: float, seed: int = 0) -> np.ndarray:
    """Readings of which a share is right, in runs of a node, and the others are of what lies behind, or between both."""
    rng = np.random.default_rng(seed)
    own = np.repeat(ranges[:, :, None], PER_NODE, axis=2) * (1 + 0.004 * rng.normal(size=(*ranges.shape, PER_NODE)))
    is_wrong = rng.random(ranges.shape) > right
    between = 0.5 + 0.5 * rng.random(ranges.shape)
    wrong = ranges + between * (BEHIND - ranges)
    own = np.where(is_wrong[:, :, None], wrong[:, :, None], own)
    return 1 / np.stack((own, np.full_like(own, BEHIND)))


def wrong_by_frame(ranges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What frames say: right, but for seven frames that take what hides one end for the object, and go on level from there."""
    said, weight = ranges.copy(), np.ones(ranges.shape)
    said[8:15] = np.linspace(0.65, 0.7, NODES)
    weight[8:15, 3:] = 0.02
    return 1 / said, weight


def chain_of(line: np.ndarray, filled: np.ndarray) -> Chain:
    """The chain through a line, of as many segments of equal length."""
    nodes = resample(line, np.linspace(0.0, arc_length(line)[-1], len(line)))
    segment = float(np.linalg.norm(np.diff(nodes, axis=0), axis=1).mean())
    return Chain(exact_lengths(nodes, segment), segment, RADIUS, depth_filled=filled)


@pytest.mark.parametrize("still", [False, True])
def test_frames_that_took_something_else_for_the_object_are_put_right(still: bool) -> None:
    points = lines(still)
    ranges, rays = np.linalg.norm(points, axis=2), unit(points)
    length = float(np.linalg.norm(np.diff(points[0], axis=0), axis=1).sum())
    inverse, weight = wrong_by_frame(ranges)
    right, weights = correct_torn_depth(inverse, weight, rays, readings_of(ranges, 0.35), RADIUS, length)
    assert np.abs(1 / inverse - ranges)[8:15].mean() > 0.1
    off = np.abs(1 / right - ranges)
    assert off[8:15].mean() < 0.02
    np.testing.assert_array_equal(np.delete(right, np.s_[8:15], axis=0), np.delete(inverse, np.s_[8:15], axis=0))
    assert (weights[8:15] > 0.3).mean() > 0.25  # what its readings show counts as measured


def test_nothing_is_put_right_where_no_reading_is_known() -> None:
    ranges = np.linalg.norm(lines(), axis=2)
    inverse, weight = wrong_by_frame(ranges)
    unknown = np.full((2, FRAMES, NODES, PER_NODE), np.nan)
    for given, kept in zip(
        (inverse, weight), correct_torn_depth(inverse, weight, unit(lines()), unknown, RADIUS, 1.0), strict=True
    ):
        np.testing.assert_array_equal(kept, given)


def test_an_object_that_lies_on_what_is_behind_it_keeps_its_readings() -> None:
    points = lines()
    ranges, rays = np.linalg.norm(points, axis=2), unit(points)
    inverse, weight = wrong_by_frame(ranges)
    own = readings_of(ranges, 1.0)[0]
    readings = np.stack((own, 1 / (1 / own + 2 * RADIUS)))
    right, _ = correct_torn_depth(inverse, weight, rays, readings, RADIUS, np.inf)
    assert np.abs(1 / right - ranges).max() < 0.02


def test_an_object_is_not_drawn_longer_than_it_is() -> None:
    """An end is read farther away than it is in all frames: only the length tells."""
    points = lines()
    ranges, rays = np.linalg.norm(points, axis=2), unit(points)
    length = float(np.linalg.norm(np.diff(points[0], axis=0), axis=1).sum())
    read = ranges * (1 + 0.003 * np.random.default_rng(1).normal(size=ranges.shape))
    read[:, -6:] += np.linspace(0.03, 0.2, 6)

    def lengths(longest: float) -> np.ndarray:
        smooth = smooth_inverse_range(1 / read, np.ones(read.shape), rays, longest)
        return np.linalg.norm(np.diff(rays / smooth[:, :, None], axis=1), axis=2).sum(axis=1)

    assert np.median(lengths(np.inf)) > 1.15 * length
    assert np.median(lengths(length)) < 1.07 * length


def torn_observations(points: np.ndarray, backwards: bool = False) -> list[Observation]:
    """Observations of a cable that is wrong in seven frames, with its readings; `backwards` for every second chain."""
    ranges, rays = np.linalg.norm(points, axis=2), unit(points)
    inverse, weight = wrong_by_frame(ranges)
    readings = readings_of(ranges, 0.35).astype(np.float32)
    observations = []
    for k in range(FRAMES):
        filled = np.minimum(weight[k][:-1], weight[k][1:]) < 1
        chain = chain_of(rays[k] / inverse[k][:, None], filled)
        own = readings[:, k]
        if backwards and k % 2:
            chain, own = reversed_chain(chain, True)[0], own[:, ::-1, ::-1]
        observations.append(Observation(Detection((chain,), coordinates="camera"), (), readings=(own,)))
    return observations


def test_a_given_length_counts_for_torn_depth() -> None:
    points = lines()
    length = float(np.linalg.norm(np.diff(points[0], axis=0), axis=1).sum())
    found = [
        np.median(
            [
                each.detection.chains[0].length
                for each in smooth_depth_over_time(torn_observations(points), TrackingConfig(), given)
            ][8:15]
        )
        for given in (length, 0.95 * length)
    ]
    assert abs(found[0] - length) < 0.02 * length
    assert found[1] < found[0] - 0.01 * length


@pytest.mark.parametrize("backwards", [False, True])
def test_chains_of_a_capture_are_put_right_whichever_way_they_run(backwards: bool) -> None:
    points = lines()
    ranges = np.linalg.norm(points, axis=2)
    observations = torn_observations(points, backwards)

    def errors(of: list[Observation]) -> list[float]:
        result = []
        for k, observation in enumerate(of):
            joints = observation.detection.chains[0].joints[:: -1 if backwards and k % 2 else 1]
            turned = arc_length(unit(joints))
            true = np.interp(turned / turned[-1], np.linspace(0.0, 1.0, NODES), ranges[k])
            result.append(float(np.abs(np.linalg.norm(joints, axis=1) - true).mean()))
        return result

    without = [replace(each, readings=()) for each in observations]
    assert max(errors(smooth_depth_over_time(without, TrackingConfig()))[8:15]) > 0.05
    assert max(errors(smooth_depth_over_time(observations, TrackingConfig()))[8:15]) < 0.02
