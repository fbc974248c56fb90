"""Depth of an object that is smoothed over the frames that show it."""

import numpy as np
import pytest

from doo3d.config import TrackingConfig
from doo3d.geometry.polyline import arc_length, resample
from doo3d.track.chain_direction import reversed_chain
from doo3d.track.depth_smoothing import MIN_FRAMES, smooth_chains, smooth_depth_over_time
from doo3d.track.inverse_range_smoother import _stiffness, smooth_inverse_range
from doo3d.track.observations import Observation
from doo3d.track.registration import exact_lengths
from doo3d.types import Chain, Detection

SEGMENTS = 50


def true_line(frame: int) -> np.ndarray:
    """An arc 1 m long that swings and bends slowly, 0.8 m before the camera: (SEGMENTS + 1, 3) m."""
    arc = np.linspace(-0.5, 0.5, SEGMENTS + 1)
    bend = 0.8 + 0.3 * np.sin(frame / 12)
    angle = bend * arc
    x, y = np.sin(angle) / bend, (1 - np.cos(angle)) / bend
    tilt = 0.4 + 0.02 * frame
    return np.column_stack((x, y * np.cos(tilt) + 0.005 * frame, 0.8 + y * np.sin(tilt) + 0.2 * x))


def chain_of(line: np.ndarray) -> Chain:
    line = resample(line, np.linspace(0, arc_length(line)[-1], len(line)))
    segment = float(np.linalg.norm(np.diff(line, axis=0), axis=1).mean())
    return Chain(exact_lengths(line, segment), segment, 0.004)


def wavy_chains(frames: range, seed: int = 0, waves: float = 0.008) -> list[Chain]:
    """Chains whose depth errs by waves 0.08 to 0.15 m long, other ones in each frame."""
    rng = np.random.default_rng(seed)
    arc = np.linspace(0, 1, SEGMENTS + 1)
    chains = []
    for frame in frames:
        line = true_line(frame)
        error = sum(
            rng.normal(0, waves / 2) * np.sin(2 * np.pi * (arc / length + rng.uniform())) for length in (0.08, 0.1, 0.12, 0.15)
        )
        chains.append(chain_of(line * (1 + error / line[:, 2])[:, None]))
    return chains


def depth_error(chain: Chain, frame: int) -> float:
    """RMS of the difference of the range at the same place in the image, m."""
    line = true_line(frame)
    at, true = chain.joints[:, 0] / chain.joints[:, 2], line[:, 0] / line[:, 2]
    return float(np.sqrt(np.mean((chain.joints[:, 2] - np.interp(at, true, line[:, 2]))[3:-3] ** 2)))


def test_waves_that_change_from_frame_to_frame_are_averaged_and_the_length_comes_out_right() -> None:
    frames = range(30)
    chains = wavy_chains(frames)
    steady = smooth_chains(list(frames), chains)
    before = np.median([depth_error(chain, k) for k, chain in enumerate(chains)])
    after = np.median([depth_error(chain, k) for k, chain in enumerate(steady)])
    assert before > 0.004
    assert after < before / 3
    true = float(np.linalg.norm(np.diff(true_line(10), axis=0), axis=1).sum())
    assert abs(np.median([chain.length for chain in steady]) - true) < 0.005
    assert np.median([chain.length for chain in chains]) - true > 0.01  # waves lengthen a chain


def test_the_place_in_the_image_stays() -> None:
    frames = range(20)
    chains = wavy_chains(frames)
    for old, new in zip(chains, smooth_chains(list(frames), chains), strict=True):
        rays, line = new.joints / new.joints[:, 2:], old.joints / old.joints[:, 2:]
        off = [np.interp(x, line[:, 0], line[:, 1]) - y for x, y, _ in rays]
        assert np.abs(off).max() < 0.002


def test_depth_without_noise_stays_as_it_is() -> None:
    frames = range(20)
    chains = [chain_of(true_line(frame)) for frame in frames]
    for old, new in zip(chains, smooth_chains(list(frames), chains), strict=True):
        assert np.abs(old.joints - new.joints).max() < 0.001


def test_a_wrong_frame_has_no_part_in_the_others() -> None:
    frames = range(20)
    chains = wavy_chains(frames)
    right = smooth_chains(list(frames), chains)
    line = true_line(10) * np.linspace(1, 1.15, SEGMENTS + 1)[:, None]
    steady = smooth_chains(list(frames), [*chains[:10], chain_of(line), *chains[11:]])
    errors = np.array([[depth_error(chain, k) for k, chain in enumerate(each)] for each in (right, steady)])
    assert np.median(errors[1]) < 1.2 * np.median(errors[0])
    assert errors[1, 10] < 0.02  # 0.07 m as it was


def test_a_chain_that_is_short_in_the_image_stays_and_counts_for_nothing() -> None:
    frames = range(20)
    chains = wavy_chains(frames)
    half = chain_of(true_line(7)[: SEGMENTS // 2 + 1])
    with_half = [*chains[:7], half, *chains[8:]]
    steady = smooth_chains(list(frames), with_half)
    without = smooth_chains([k for k in frames if k != 7], [*chains[:7], *chains[8:]])
    assert steady[7] is half
    for new, other in zip([*steady[:7], *steady[8:]], without, strict=True):
        np.testing.assert_allclose(new.joints, other.joints)


@pytest.mark.parametrize("count", [1, MIN_FRAMES - 1])
def test_few_frames_are_left_alone(count: int) -> None:
    chains = wavy_chains(range(count))
    assert smooth_chains(list(range(count)), chains) == chains


def test_the_penalty_is_that_of_second_differences() -> None:
    rng = np.random.default_rng(3)
    frames, nodes = 6, 5
    field = rng.normal(size=(frames, nodes))
    bands = _stiffness((frames, nodes), 3.0, 0.5, 0.2)
    size = frames * nodes
    matrix = np.zeros((size, size))
    for offset, band in enumerate(bands):
        for column in range(size - offset):
            matrix[column + offset, column] = matrix[column, column + offset] = band[column]
    time, line = np.diff(field, 2, axis=0), np.diff(field, 2, axis=1)
    expected = 3.0 * (np.diff(line, 2, axis=0) ** 2).sum() + 0.5 * (line**2).sum() + 0.2 * (time**2).sum()
    assert field.ravel() @ matrix @ field.ravel() == pytest.approx(expected, rel=1e-6)


def test_places_that_were_never_measured_are_filled() -> None:
    frames = range(12)
    lines = np.array([true_line(frame) for frame in frames])
    distance = np.linalg.norm(lines, axis=2)
    distance *= 1 + 0.002 * np.random.default_rng(0).normal(size=distance.shape)
    weight = np.ones(distance.shape)
    weight[4:7, 20:26] = 0
    rays = np.where(weight[:, :, None] > 0, lines / distance[:, :, None], np.nan)
    smooth = smooth_inverse_range(np.where(weight > 0, 1 / distance, 0.0), weight, rays)
    assert np.abs(1 / smooth - distance)[4:7, 20:26].max() < 0.01


def chains_smoothed_over_time(chains: list[Chain]) -> list[Chain]:
    """Return the chains of successive frames with their depth smoothed, by way of tracking."""
    observations = [Observation(Detection(chains=(chain,), coordinates="camera"), ()) for chain in chains]
    return [observation.detection.chains[0] for observation in smooth_depth_over_time(observations, TrackingConfig())]


def test_chains_are_the_same_object_in_the_image_however_wrong_their_depth_and_lengths_are() -> None:
    """Depth is lost on half of the cable, in another place in each frame, and filled in up to 60 % too far away."""
    rng = np.random.default_rng(1)
    share, chains, frames = np.linspace(0, 1, SEGMENTS + 1), [], range(30)
    for frame in frames:
        place = np.clip((share - rng.uniform(0.0, 0.5)) / 0.5, 0.0, 1.0)
        away = 1 + rng.uniform(0.2, 0.6) * np.sin(np.pi * place) ** 2
        line = true_line(frame) * away[:, None]
        each = chain_of(line)
        arcs = arc_length(line)
        lost = np.interp(np.linspace(0.0, arcs[-1], SEGMENTS + 1), arcs, away) > 1.002
        chains.append(Chain(each.joints, each.segment_length, 0.004, depth_filled=lost[:-1] | lost[1:]))
    true = [float(np.linalg.norm(np.diff(true_line(k), axis=0), axis=1).sum()) for k in frames]
    before = [abs(chain.length - length) / length for chain, length in zip(chains, true, strict=True)]
    after = [abs(chain.length - length) / length for chain, length in zip(chains_smoothed_over_time(chains), true, strict=True)]
    assert np.median(before) > 0.1
    assert np.median(after) < 0.05


def test_frames_that_show_less_of_an_object_are_smoothed_by_themselves() -> None:
    """From frame 15 on something hides the last third: shares of the length are other places there."""
    frames = range(30)
    chains = [chain_of(true_line(k)[: 35 if k >= 15 else None]) for k in frames]
    for frame, chain in zip(frames, chains_smoothed_over_time(chains), strict=True):
        assert depth_error(chain, frame) < 0.002


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.1, 0.2, 1.0)])
def test_a_chain_that_is_seen_end_on_stays(direction: tuple[float, float, float]) -> None:
    """It has no length in the image, and no direction."""
    sight = np.array(direction) / np.linalg.norm(direction)
    for joints in (1, 30):
        chains = [Chain(np.outer(0.5 + 0.01 * np.arange(joints + 1), sight), 0.01, 0.004)] * 5
        assert chains_smoothed_over_time(chains) == chains


@pytest.mark.parametrize("lost", [0, 4, 20])
@pytest.mark.parametrize("turned", [False, True])
def test_a_chain_that_was_lost_is_smoothed_with_those_before_whichever_way_round_it_comes_back(lost: int, turned: bool) -> None:
    """After 20 frames it is tilted so far that it bends along the line of sight alone, which the image does not tell."""
    frames = [*range(15), *range(15 + lost, 30 + lost)]
    chains = wavy_chains(range(30 + lost))
    given = [reversed_chain(chains[frame], turned and frame >= 15)[0] for frame in frames]
    seen = dict(zip(frames, given, strict=True))
    found = [Detection(chains=(seen[k],) if k in seen else (), coordinates="camera") for k in range(30 + lost)]
    steady = smooth_depth_over_time([Observation(each, ()) for each in found], TrackingConfig())
    laid = [reversed_chain(steady[frame].detection.chains[0], turned and frame >= 15)[0] for frame in frames]
    before = [depth_error(chains[frame], frame) for frame in frames]
    after = [depth_error(chain, frame) for chain, frame in zip(laid, frames, strict=True)]
    assert np.median(after) < np.median(before) / 2
    assert max(after) < max(before)
