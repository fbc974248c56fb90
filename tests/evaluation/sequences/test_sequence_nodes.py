"""Nodes against the material, over time: chains that are right, and chains damaged in every way."""

import numpy as np
import pytest

from doo3d.evaluation.scenes.model import Truth
from doo3d.evaluation.sequences.nodes import NODES, find_jumps, measured_nodes, node_offsets, true_nodes
from doo3d.types import Chain

RADIUS, LENGTH, FRAMES = 0.004, 0.5, 7
STEP = np.array([0.0, 0.03, 0.0])  # m a frame, over 5 radii: a real motion is no jump


def truths(frames=FRAMES):
    x = np.linspace(0.0, LENGTH, 1001)
    axis = np.column_stack((x, np.zeros_like(x), np.full_like(x, 0.6)))
    return [Truth(axis + frame * STEP, RADIUS) for frame in range(frames)]


def chain_between(truth, start, end, count=50):
    """Return a chain along the straight cable from one arc length to another, m."""
    joints = truth.axis[0] + np.linspace(start, end, count + 1)[:, None] * np.array([1.0, 0.0, 0.0])
    return Chain(joints, abs(end - start) / count, RADIUS)


def whole(cables):
    return [chain_between(cable, 0.0, LENGTH) for cable in cables]


def distances(chains, cables, keeps_direction=True):
    return np.linalg.norm(node_offsets(chains, cables, keeps_direction), axis=2)


def jumps(chains, cables, keeps_direction=True):
    found, counted = find_jumps(node_offsets(chains, cables, keeps_direction), RADIUS)
    return found.sum(axis=1).tolist(), counted.tolist()


@pytest.mark.parametrize("backwards", [False, True])
def test_chains_that_move_with_the_cable_are_right_in_both_directions(backwards):
    cables = truths()
    chains = [chain_between(cable, LENGTH, 0.0) for cable in cables] if backwards else whole(cables)
    assert distances(chains, cables).max() < 1e-9
    assert jumps(chains, cables) == ([0] * FRAMES, [False] + [True] * (FRAMES - 1))


def test_a_chain_that_turns_round_is_wrong_where_directions_are_kept():
    cables = truths()
    chains = whole(cables)
    chains[3] = chain_between(cables[3], LENGTH, 0.0)
    assert distances(chains, cables, keeps_direction=False).max() < 1e-9
    kept = distances(chains, cables)
    assert kept[3].mean() == pytest.approx(LENGTH / 2, rel=0.05)
    assert np.delete(kept, 3, axis=0).max() < 1e-9
    found, _ = jumps(chains, cables)
    assert found[3] == found[4] > 0.9 * NODES
    assert sum(found) == 2 * found[3]


def test_a_chain_that_slides_along_is_off_by_as_much():
    cables = truths()
    chains = [chain_between(cable, 0.01, LENGTH + 0.01) for cable in cables]
    assert distances(chains, cables) == pytest.approx(0.01)
    assert sum(jumps(chains, cables)[0]) == 0  # it slid before the first frame


def test_a_lost_end_moves_all_nodes_and_makes_the_far_ones_jump():
    cables = truths()
    chains = whole(cables)
    chains[4] = chain_between(cables[4], 0.0, 0.6 * LENGTH)
    at = distances(chains, cables)[4]
    assert at[[0, -1]] == pytest.approx([0.0, 0.4 * LENGTH])
    assert (np.diff(at) > 0).all()
    far = int((at > 5 * RADIUS).sum())
    assert jumps(chains, cables)[0] == [0, 0, 0, 0, far, far, 0]


def test_frames_without_a_chain_have_no_nodes_and_excuse_no_jump():
    cables = truths()
    chains = whole(cables)
    chains[2] = None
    assert np.isnan(distances(chains, cables)[2]).all()
    assert jumps(chains, cables) == ([0] * FRAMES, [False, True, False, True, True, True, True])
    chains[3:] = [chain_between(cable, 0.1, LENGTH + 0.1) for cable in cables[3:]]
    assert jumps(chains, cables)[0] == [0, 0, 0, NODES, 0, 0, 0]
    assert np.isnan(distances([None] * FRAMES, cables)).all()
    assert jumps([None] * FRAMES, cables) == ([0] * FRAMES, [False] * FRAMES)


def test_the_number_of_segments_does_not_matter():
    cables = truths()
    chains = [chain_between(cable, 0.0, LENGTH, 20 + 7 * frame) for frame, cable in enumerate(cables)]
    assert distances(chains, cables).max() < 1e-9


def test_nodes_are_measured_where_the_camera_sees_them_and_depth_is_not_lost():
    (cable,) = truths(1)
    depth = np.ones((4, 4))
    assert measured_nodes(cable, depth).all()
    assert not measured_nodes(cable, 0 * depth).any()
    seen = cable.axis[:, 0] > 0.25
    part = measured_nodes(Truth(cable.axis, RADIUS, seen=seen, shiny=((0.4, 0.5),)), depth)
    x = true_nodes(cable)[:, 0]
    assert np.array_equal(part, (x > 0.25) & (x < 0.4))
