"""Fitting: the paper's Algorithm 2 on ordered points."""

from __future__ import annotations

import numpy as np
import pytest

from doo3d.chains.fit import fit
from doo3d.config import FitConfig
from doo3d.types import Path


def fitted(paths, config):
    """The chains along paths, with the segment length of the config."""
    return fit(paths, config.segment_length, config)


def literal(contour, length, small):
    """Algorithm 2 as it stands in the paper; `small` radians is what it calls small."""
    collection = []
    p_s = contour[0]
    chain = []
    p_t = p_s
    update_tip = True
    s = None
    for p_c in contour:
        if np.linalg.norm(p_c - p_s) >= length:
            p_e = p_s + length * (p_c - p_s) / np.linalg.norm(p_c - p_s)
            new = p_e - p_s
            if not chain or np.arccos(np.clip(s @ new / np.linalg.norm(s) / np.linalg.norm(new), -1, 1)) <= small:
                chain.append((p_s, p_e))
                s, p_s, p_t = new, p_e, p_e
            else:
                collection.append(chain)
                chain = []
                p_s = p_t
            update_tip = True
        elif np.linalg.norm(p_c - p_s) >= np.linalg.norm(p_t - p_s):
            if update_tip:
                p_t = p_c
        else:
            update_tip = False
    if chain:
        collection.append(chain)
    return [np.array([chain[0][0], *(end for _, end in chain)]) for chain in collection]


def jagged(seed, dim):
    """A random walk with smooth stretches and sharp turns."""
    random = np.random.default_rng(seed)
    heading, points = np.ones(dim) / np.sqrt(dim), [np.zeros(dim)]
    for _ in range(400):
        heading = heading + 0.15 * random.normal(size=dim)
        heading = (-heading if random.random() < 0.02 else heading) / np.linalg.norm(heading)
        points.append(points[-1] + random.uniform(0.2, 1.0) * heading)
    return np.array(points)


def lie(chains, expected):
    assert len(chains) == len(expected)
    for chain, joints in zip(chains, expected, strict=True):
        np.testing.assert_allclose(chain, joints, atol=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(6))
def test_against_the_paper(seed, dim):
    points = jagged(seed, dim)
    expected = literal(points, 2.5, np.radians(55))
    assert len(expected) > 2
    lie(fitted([Path(points)], FitConfig(segment_length=2.5, max_turn=55)), expected)


def straight(length, dim, spacing=0.1):
    return np.pad(np.arange(0, length + spacing / 2, spacing)[:, None], ((0, 0), (0, dim - 1)))


@pytest.mark.parametrize("dim", [2, 3])
def test_a_line_gives_whole_segments(dim):
    chains = fitted([Path(straight(10.35, dim))], FitConfig(segment_length=1.0))
    assert chains.closed.tolist() == [False]
    np.testing.assert_allclose(chains.points, straight(10, dim, 1.0), atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_path_shorter_than_a_segment_gives_none(dim):
    config = FitConfig(segment_length=1.0)
    assert len(fitted([Path(straight(0.9, dim))], config)) == 0
    curled = np.pad(0.45 * np.column_stack((np.cos(np.arange(30)), np.sin(np.arange(30)))), ((0, 0), (0, dim - 2)))
    assert len(fitted([Path(curled)], config)) == 0
    assert len(fitted([Path(np.zeros((1, dim)))], config)) == 0
    assert len(fitted([Path(np.zeros((0, dim)))], config)) == 0
    assert len(fitted([], config)) == 0
    (chain,) = fitted([Path(straight(0.9, dim)), Path(straight(1.1, dim))], config)
    assert len(chain) == 2


@pytest.mark.parametrize("dim", [2, 3])
def test_a_contour_round_a_branch_ends_a_chain_at_the_tip(dim):
    """There and back: the way back starts from the tip, the farthest point, which is not a whole number of segments out."""
    out = straight(5.4, dim)
    chains = fitted([Path(np.concatenate((out, out[-2::-1])))], FitConfig(segment_length=1.0))
    lie(chains, [straight(5.0, dim, 1.0), out[-1] - straight(5.0, dim, 1.0)])


@pytest.mark.parametrize(("turn", "chains"), [(30, 1), (59, 1), (61, 2), (120, 2)])
def test_a_sharp_turn_ends_a_chain(turn, chains):
    heading = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
    points = np.concatenate((straight(5.0, 2), [5, 0] + np.arange(0.1, 5.05, 0.1)[:, None] * heading))
    found = fitted([Path(points)], FitConfig(segment_length=1.0, max_turn=60))
    assert len(found) == chains
    np.testing.assert_allclose(found[0][:6], straight(5.0, 2, 1.0), atol=1e-9)
    np.testing.assert_allclose(found.points[-1], [5, 0] + (5 if chains == 1 else 4) * heading, atol=1.1)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_ring_makes_one_closed_chain(dim):
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    points = np.pad(5 * np.column_stack((np.cos(angle), np.sin(angle))), ((0, 0), (0, dim - 2)))
    chains = fitted([Path(points, closed=True)], FitConfig(segment_length=1.0))
    assert chains.closed.tolist() == [True]
    assert np.linalg.norm(chains.points[-1] - chains.points[0]) < 1.0
    assert chains.lengths[0] == pytest.approx(2 * np.pi * 5, abs=1.2)


def test_an_open_path_back_to_its_start_is_not_closed():
    angle = np.linspace(0, 2 * np.pi, 200)
    chains = fitted([Path(np.column_stack((np.cos(angle), np.sin(angle))))], FitConfig(segment_length=0.2))
    assert chains.closed.tolist() == [False]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("closed", [False, True])
def test_points_farther_apart_than_a_segment_are_followed_to_the_end(dim, closed):
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=not closed)
    points = np.pad(8 * np.column_stack((np.cos(angle), np.sin(angle))), ((0, 0), (0, dim - 2)))
    chains = fitted([Path(points, closed=closed)], FitConfig(segment_length=0.1))
    assert chains.lengths == pytest.approx(2 * np.pi * 8, rel=0.01)
    assert np.abs(np.linalg.norm(chains.points, axis=1) - 8).max() < 0.05
    assert chains.closed.tolist() == [closed]
