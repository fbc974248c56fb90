"""Perfect estimators: what they know, and how it is scored."""

import numpy as np
import pytest

from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.scenes.model import Truth
from doo3d.evaluation.sequences.nodes import NODES, ORACLES, node_offsets, oracle_detections, oracle_nodes

LINE = np.column_stack((np.linspace(0, 0.4, 5), np.zeros(5), np.ones(5)))


def moving(shifts):
    """Return five nodes that all move in y by the shifts, one of each frame."""
    return np.array([LINE + np.array((0, shift, 0)) for shift in shifts])


@pytest.mark.parametrize("past_only", [True, False])
def test_hidden_nodes_move_as_the_measured_ones_beside_them(past_only):
    true = moving([0.0, 0.1, 0.3])
    measured = np.ones((3, 5), dtype=bool)
    measured[1, 2:] = measured[2, 4] = False
    np.testing.assert_allclose(oracle_nodes(true, measured, past_only), true, atol=1e-12)


def test_a_frame_without_anything_is_held_or_interpolated():
    true = moving([0.0, 0.1, 0.2, 0.6])
    measured = np.array([[True] * 5, [False] * 5, [False] * 5, [True] * 5])
    past, both = (oracle_nodes(true, measured, past_only) for past_only in (True, False))
    np.testing.assert_allclose(past[1:3], moving([0.0, 0.0]))
    assert oracle_nodes(true, measured[[0, 0, 1, 1]], True)[2:, 0, 1] == pytest.approx([0.2, 0.3])
    np.testing.assert_allclose(both[1:3], moving([0.2, 0.4]))
    np.testing.assert_allclose(past[3], true[3])


def test_later_frames_make_the_oracle_better():
    x = np.linspace(-0.2, 0.2, 801)
    truths = [Truth(np.column_stack((x, 0.05 * np.sin(8 * x + 0.2 * k), np.full(801, 0.6))), 0.004) for k in range(12)]
    measured = [np.ones(NODES, dtype=bool) for _ in truths]
    for k in range(2, 10):
        measured[k][15:32] = False
    errors = {}
    for name, past_only in ORACLES.items():
        detections = oracle_detections(truths, measured, past_only)
        chains = [detection.chains[0] for detection in detections]
        errors[name] = np.linalg.norm(node_offsets(chains, truths, keeps_direction=True), axis=2)
        assert score(detections[0].chains, truths[:1]).correct
        assert errors[name][[0, 1, 10, 11]].max() < 1e-3
        assert [chain.occluded.any() for chain in chains] == [False] * 2 + [True] * 8 + [False] * 2
    past, both = (errors[name][2:10, 15:32].mean() for name in ORACLES)
    assert both < past
