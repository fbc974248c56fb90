"""An end that goes on behind what hides it, to a bit of surface too short for a chain of its own."""

from __future__ import annotations

import numpy as np
import pytest
from builders.drawn_masks import CAMERA, frame_of, line

import doo3d

RADIUS = 0.004
AXIS = line([-0.15, 0.0, 0.5], [0.15, 0.0, 0.5])


def found(front: float | None, first: float, last: float, **settings: float) -> doo3d.Chain:
    """The chain of a straight cable; from `first` to `last` m along x there is something at `front` m instead, or a hole."""
    frame, mask = frame_of(AXIS, radius=RADIUS, table=0.52)
    x = (np.arange(640) - CAMERA.cx) / CAMERA.fx * 0.5
    hidden = ((x > first) & (x < last))[None] & np.ones((480, 1), bool)
    depth = np.where(hidden, frame.depth.max() if front is None else front, frame.depth).astype(np.float32)
    config = doo3d.load_config("default", {f"refine.{key}": value for key, value in settings.items()})
    (chain,) = doo3d.detect(doo3d.Frame(None, depth, CAMERA), config, mask & ~hidden).chains
    return chain


def end(chain: doo3d.Chain) -> float:
    return float(chain.joints[:, 0].max())


def test_the_chain_goes_on_to_the_stub():
    chain = found(0.45, 0.125, 0.142)
    assert end(chain) == pytest.approx(0.15, abs=RADIUS)
    middle = (chain.joints[1:, 0] + chain.joints[:-1, 0]) / 2
    assert chain.occluded[(middle > 0.129) & (middle < 0.138)].all()
    assert not chain.occluded[middle < 0.12].any()


def test_it_does_not_where_nothing_hides_the_way():
    assert end(found(None, 0.125, 0.142)) < 0.13


def test_it_does_not_go_farther_than_stub_says():
    assert end(found(0.45, 0.09, 0.142)) < 0.1
