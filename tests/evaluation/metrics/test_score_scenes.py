"""The score on the scenes it is used on: the truth scores in full on every family, and damage to it costs what it must."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from doo3d.evaluation.metrics.crossings import true_crossings
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.rendering.rays import RayCaster
from doo3d.evaluation.scenes.registry import FAMILIES, make_scene
from doo3d.kernels import lay_equal_chords
from doo3d.types import Chain, Crossing, SegmentRef

STEP = 0.005


@lru_cache
def truths_of(family, seed):
    scene = make_scene(family, seed)
    caster = RayCaster(scene)
    return tuple(replace(cable, seen=caster.seen_samples(cable)) for cable in scene.cables)


def chain_of(truth, axis=None):
    return Chain(lay_equal_chords(truth.axis if axis is None else axis, STEP)[0], STEP, truth.radius)


def crossings_of(truths):
    true = true_crossings(truths)
    places = [
        [SegmentRef(int(c), int(s / STEP)) for c, s in zip(*both, strict=True)] for both in zip(true.cable, true.arc, strict=True)
    ]
    return [Crossing(*pair, np.zeros(3)) for pair in places]


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_truth_of_every_family_scores_in_full(family, seed):
    truths = truths_of(family, seed)
    got = score([chain_of(truth) for truth in truths], truths, crossings_of(truths))
    assert got.correct, got.reasons
    assert got.connections > 10
    assert got.connections_wrong == 0
    assert got.occlusions_correct == got.occlusions
    assert (got.crossings_correct, got.crossings_extra) == (got.crossings, 0)
    assert max(got.rms_seen, got.node_error) < 1e3 * STEP
    assert got.radius_ratio == pytest.approx(1)


@pytest.mark.parametrize("family", FAMILIES)
def test_damage_to_one_cable_is_seen_in_every_family(family):
    truths = truths_of(family, 0)
    whole, axis, rest = truths[0], truths[0].axis, [chain_of(truth) for truth in truths[1:]]
    third, half = len(axis) // 3, len(axis) // 2

    turned = np.concatenate((axis[:third], axis[third : 2 * third][::-1], axis[2 * third :]))
    got = score([chain_of(whole, turned), *rest], truths)
    assert not got.correct
    assert got.connections_wrong >= 2

    got = score([chain_of(whole, axis[:half]), chain_of(whole, axis[half:]), *rest], truths)
    assert not got.correct
    assert (got.chains, got.connections_wrong) == (len(truths) + 1, 0)

    got = score([chain_of(whole, axis[: int(0.85 * len(axis))]), *rest], truths)
    assert not got.correct
    assert got.coverage == pytest.approx(0.85, abs=0.03)

    beside = axis + np.array([0, 0, -max(2 * whole.radius, 0.006)])
    got = score([chain_of(whole, beside), *rest], truths)
    assert not got.correct
    assert got.off_fraction > 0.03
