"""The score: what is right scores in full, and each way of being wrong costs what it must."""

from dataclasses import replace

import numpy as np
import pytest
from builders.chains import along

from doo3d.evaluation.metrics.nodes import node_error
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.scenes.model import Truth
from doo3d.types import Chain, Connection

RADIUS = 0.004


def _dense(points):
    gap = np.linalg.norm(np.diff(points, axis=0), axis=1)
    arcs = np.concatenate(([0], np.cumsum(gap)))
    at = np.linspace(0, arcs[-1], int(arcs[-1] / 0.0005) + 2)
    return np.column_stack([np.interp(at, arcs, points[:, k]) for k in range(3)])


def _wave():
    x = np.linspace(0, 0.5, 3000)
    return _dense(np.column_stack((x, 0.06 * np.sin(12 * x), np.full(len(x), 0.6))))


def _loop():
    """Crosses itself once, two radii and a little apart there."""
    t = np.linspace(-1.2, 1.2, 4000)
    return _dense(np.column_stack((0.15 * (t**3 - 0.8 * t), 0.15 * t**2, 0.6 + 0.0052 * t)))


def _truth(axis, *hidden):
    seen = np.ones(len(axis), dtype=bool)
    for a, b in hidden:
        seen[a:b] = False
    return Truth(axis, RADIUS, seen=seen)


TRUTHS = {"wave": _truth(_wave(), (300, 360), (700, 730)), "loop": _truth(_loop(), (400, 420), (600, 680))}


@pytest.mark.parametrize("name", TRUTHS)
@pytest.mark.parametrize("segment", [0.004, 0.01, 0.02])
@pytest.mark.parametrize("turned", [False, True])
def test_the_truth_itself_scores_in_full(name, segment, turned):
    truth = TRUTHS[name]
    got = score([along(truth.axis[::-1] if turned else truth.axis, segment)], [truth])
    assert got.correct, got.reasons
    assert (got.occlusions, got.occlusions_correct) == (2, 2)
    assert got.connections > 0
    assert got.connections_wrong == 0
    sag = 1e3 * segment**2 / 8 / 0.05  # of a chord, mm; nothing here bends tighter than 50 mm
    assert got.rms_seen < 0.25 + sag
    assert got.rms_hidden < 0.25 + sag
    assert got.radius_ratio == pytest.approx(1)
    assert got.end_error < 1e3 * segment / 2 + 0.1
    assert got.node_error < 1e3 * segment / 2 + sag
    assert got.coverage > 0.96
    assert got.off_fraction == 0


@pytest.mark.parametrize("name", TRUTHS)
def test_noise_does_not_break_the_order(name):
    truth, rng = TRUTHS[name], np.random.default_rng(0)
    rough = truth.axis[::8] + rng.normal(0, 0.0005, truth.axis[::8].shape)
    got = score([along(_dense(rough), 0.005)], [truth])
    assert got.correct, got.reasons
    assert got.occlusions_correct == 2


def test_offset_is_measured():
    truth = TRUTHS["wave"]
    got = score([along(truth.axis + np.array([0, 0, 0.002]), 0.002)], [truth])
    assert got.correct
    assert got.rms_seen == pytest.approx(2.0, abs=0.02)
    assert got.rms_hidden == pytest.approx(2.0, abs=0.02)
    assert got.node_error == pytest.approx(2.0, abs=0.2)


def test_two_radii_beside_is_off():
    truth = TRUTHS["wave"]
    got = score([along(truth.axis + np.array([0, 0, 2 * RADIUS]), 0.002)], [truth])
    assert not got.correct
    assert got.off_fraction > 0.7  # all but the hidden parts, where more is allowed
    assert got.rms_seen == pytest.approx(8.0, abs=0.1)
    assert got.connections_wrong == 0
    assert got.occlusions_correct == 2


def test_inner_part_reversed_is_two_wrong_connections():
    for truth in TRUTHS.values():
        a, b = len(truth.axis) // 3, 2 * len(truth.axis) // 3
        order = np.concatenate((truth.axis[:a], truth.axis[a:b][::-1], truth.axis[b:]))
        got = score([along(_dense(order))], [truth])
        assert not got.correct
        assert got.connections_wrong == 2
        assert got.node_error > 20


def test_swapped_at_a_crossing():
    truth = TRUTHS["loop"]
    gap = np.linalg.norm(truth.axis[:, None] - truth.axis[None], axis=-1)
    apart = np.abs(np.subtract.outer(np.arange(len(gap)), np.arange(len(gap)))) > 200
    a, b = np.unravel_index(np.where(apart, gap, 1).argmin(), gap.shape)
    a, b = min(a, b), max(a, b)
    whole = np.concatenate((truth.axis[:a], truth.axis[a:b][::-1], truth.axis[b:]))
    got = score([along(_dense(whole))], [truth])
    assert not got.correct
    assert got.connections_wrong == 2
    assert got.coverage > 0.94
    short = np.concatenate((truth.axis[:a], truth.axis[b:]))
    got = score([along(_dense(short))], [truth])
    assert got.connections_wrong == 1
    assert got.coverage < 0.7


def test_cut_in_two_at_an_occlusion():
    truth = TRUTHS["wave"]
    got = score([along(truth.axis[:302]), along(truth.axis[358:])], [truth])
    assert not got.correct
    assert (got.occlusions, got.occlusions_correct) == (2, 1)
    assert got.connections_wrong == 0
    assert "2 chains for 1 objects" in got.reasons


def test_cut_short():
    truth = TRUTHS["wave"]
    got = score([along(truth.axis[: int(0.8 * len(truth.axis))])], [truth])
    assert not got.correct
    assert got.node_error == pytest.approx(1e3 * 0.2 * truth.length / 2, rel=0.2)  # from nothing at one end to all at the other
    assert got.coverage == pytest.approx(0.8, abs=0.02)
    assert got.end_error > 30
    assert score([along(truth.axis[: int(0.97 * len(truth.axis))])], [truth]).correct


def test_extra_chain_and_missing_chain():
    truth = TRUTHS["wave"]
    extra = Chain(np.array([[0.0, 0.3, 0.6], [0.01, 0.3, 0.6], [0.02, 0.3, 0.6]]), 0.01, RADIUS)
    got = score([along(truth.axis), extra], [truth])
    assert not got.correct
    assert got.off_fraction == 1
    assert got.rms_seen < 0.4
    got = score([], [truth])
    assert not got.correct
    assert (got.coverage, got.occlusions, got.occlusions_correct) == (0, 2, 0)


def test_a_hidden_part_may_stray_a_fifth_of_the_run():
    axis = _dense(np.array([[0.0, 0, 0.6], [0.5, 0, 0.6]]))
    truth = _truth(axis, (400, 600))
    for bulge, good in ((0.015, True), (0.03, False)):
        path = axis.copy()
        path[400:600, 1] += bulge * np.sin(np.linspace(0, np.pi, 200))
        got = score([along(path)], [truth])
        assert got.occlusions_correct == good
        assert got.correct == good
        assert got.rms_hidden > 1000 * bulge / 3


def test_two_cables_swapped_where_they_cross():
    x = np.linspace(-0.2, 0.2, 801)
    one, other = np.column_stack((x, x, np.full(801, 0.6))), np.column_stack((x, -x, np.full(801, 0.608)))
    truths = [_truth(one), _truth(other, (385, 416))]
    right = score([along(other), along(one[::-1])], truths)
    assert right.correct
    assert right.occlusions_correct == 1
    swapped = [along(_dense(np.concatenate((one[:395], other[405:])))), along(_dense(np.concatenate((other[:395], one[405:]))))]
    got = score(swapped, truths)
    assert not got.correct
    assert got.connections_wrong == 2
    assert got.occlusions_correct == 0


def test_ring_scores_in_full_wherever_it_starts():
    angle = np.arange(1200) * 2 * np.pi / 1200
    axis = np.column_stack((0.09 * np.cos(angle), 0.09 * np.sin(angle), np.full(1200, 0.6)))
    seen = np.ones(1200, dtype=bool)
    seen[1180:] = seen[:30] = False
    truth = Truth(axis, RADIUS, closed=True, seen=seen)
    for start in (0, 500, 1190):
        turned = np.roll(axis, -start, axis=0)
        joints = np.vstack((turned[::20], turned[:1]))
        length = np.linalg.norm(joints[1] - joints[0])
        for chain in (Chain(joints, length, RADIUS, closed=True), Chain(joints[::-1], length, RADIUS, closed=True)):
            got = score([chain], [truth])
            assert got.correct, got.reasons
            assert (got.occlusions, got.connections_wrong) == (1, 0)
            assert got.occlusions_correct == 1
            assert got.node_error < 1


def test_nothing_there_and_nothing_found_is_correct():
    assert score([], []).correct
    assert not score([along(_wave())], []).correct


def _joined(chain, *at):
    """The chain with connections at segments."""
    return replace(chain, connections=tuple(Connection(segment, 0.5) for segment in at))


def test_a_merge_is_wrong_where_the_order_breaks():
    x = np.linspace(-0.2, 0.2, 801)
    one, other = np.column_stack((x, x, np.full(801, 0.6))), np.column_stack((x, -x, np.full(801, 0.608)))
    truths = [_truth(one), _truth(other)]
    right = [_joined(along(one), 10, 28), _joined(along(other), 28)]
    assert (score(right, truths).merges, score(right, truths).merges_wrong) == (3, 0)
    swapped = [_dense(np.concatenate((one[:395], other[405:]))), _dense(np.concatenate((other[:395], one[405:])))]
    wrong = [_joined(along(swapped[0]), 10, 28), _joined(along(swapped[1]), 28)]
    assert (score(wrong, truths).merges, score(wrong, truths).merges_wrong) == (3, 2)
    far = [_joined(along(swapped[0]), 5), along(swapped[1])]  # nothing was joined where the order breaks
    assert (score(far, truths).merges, score(far, truths).merges_wrong) == (1, 0)


def test_a_merge_with_what_is_no_cable_is_wrong():
    axis = _dense(np.array([[0.0, 0, 0.6], [0.3, 0, 0.6]]))
    beyond = _dense(np.vstack((axis, [[0.3, 0.2, 0.6]])))
    hidden = np.zeros(len(along(beyond).occluded), dtype=bool)
    hidden[28:38] = True
    chain = replace(_joined(along(beyond), 33), occluded=hidden)
    assert score([chain], [_truth(axis)]).merges_wrong == 1
    assert score([chain], [_truth(beyond)]).merges_wrong == 0
    assert score([chain], []).merges_wrong == 1


def test_nodes_of_a_ring_that_was_not_closed():
    angle = np.arange(1200) * 2 * np.pi / 1200
    axis = np.column_stack((0.09 * np.cos(angle), 0.09 * np.sin(angle), np.full(1200, 0.6)))
    truth = Truth(axis, RADIUS, closed=True)
    cut = np.roll(axis, -333, axis=0)[:1195]
    for way in (cut, cut[::-1]):
        assert node_error(along(way), truth) < 10 / 2 + 3
    half = along(axis[:600])
    assert node_error(half, truth) > 40
