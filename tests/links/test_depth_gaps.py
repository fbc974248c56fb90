"""A strand that is seen in the mask goes on, whatever its depth says: ends are joined along it without a cost."""

from __future__ import annotations

import numpy as np

import doo3d
from doo3d.pipeline import detect_with_stages
from doo3d.types import Camera, Frame

CAMERA = Camera(fx=600.0, fy=600.0, cx=160.0, cy=120.0, width=320, height=240)
BACKGROUND, CABLE = 1.2, 0.8


def frame_of(mask, depth):
    """A frame whose cable has a depth (H, W) or (W,) m, 0 = lost, and a plane behind."""
    return Frame(None, np.where(mask, depth, BACKGROUND).astype(np.float32), CAMERA)


def band(rows, columns):
    mask = np.zeros((240, 320), dtype=bool)
    mask[rows, columns] = True
    return mask


def detected(mask, depth, **settings):
    return detect_with_stages(frame_of(mask, depth), doo3d.load_config("default", settings), mask)


STRAIGHT = band(slice(116, 125), slice(20, 300))
LEAPING = np.repeat((CABLE, 0.0, CABLE - 0.3), (120, 80, 120))
"""Depth by column: one, then lost, then one that no filter takes for the same strand."""


def test_a_strand_that_is_seen_but_leaps_in_depth_is_one_chain():
    detection, stages = detected(STRAIGHT, LEAPING)
    assert len(stages.pruned.chains) == 2
    assert len(detection.chains) == 1
    seen = CAMERA.project(detection.chains[0].joints)
    assert seen[:, 0].min() < 40
    assert seen[:, 0].max() > 280


def test_its_connections_cost_nothing():
    _, stages = detected(STRAIGHT, LEAPING)
    assert [decision.chosen.cost for decision in stages.merged.decisions] == [0.0]
    assert set(stages.merged.decisions[0].chosen.terms.values()) == {0.0}


def test_the_gap_follows_the_bend_of_the_mask():
    mask = band(slice(116, 125), slice(20, 169)) | band(slice(116, 220), slice(160, 169))
    depth = np.where(np.arange(320) < 100, CABLE, 0.0) * np.ones((240, 1))
    depth[170:] = CABLE - 0.5
    detection, stages = detected(mask, depth)
    assert [decision.chosen.cost for decision in stages.merged.decisions] == [0.0]
    u, v = np.rint(CAMERA.project(detection.chains[0].joints)).astype(int).T
    assert mask[v.clip(0, 239), u.clip(0, 319)].mean() > 0.95


def test_two_masks_apart_are_two_chains():
    mask = STRAIGHT & ((np.arange(320) < 130) | (np.arange(320) > 190))
    detection, _ = detected(mask, LEAPING)
    assert len(detection.chains) == 2


def test_the_greedy_strategy_of_the_paper_does_not_look_at_the_mask():
    detection, _ = detected(STRAIGHT, LEAPING, **{"merge.strategy": "greedy"})
    assert len(detection.chains) == 2


def test_a_gap_that_a_crossing_strand_covers_is_weighed():
    crossing = band(slice(20, 220), slice(156, 165))
    detection, stages = detected(STRAIGHT | crossing, np.where(crossing, CABLE - 0.03, CABLE))
    assert len(detection.chains) == 2
    assert stages.merged.decisions
    assert all(decision.chosen.cost > 0 for decision in stages.merged.decisions)


def test_in_a_pile_the_mask_between_two_ends_tells_nothing():
    detection, _ = detected(STRAIGHT, LEAPING, **{"visibility.own_object_counts_as_free": True})
    assert len(detection.chains) == 2
