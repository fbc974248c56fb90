"""Frames that grow in one respect."""

from __future__ import annotations

import pytest

from doo3d import load_config
from doo3d.pipeline import detect
from doo3d.tools.scaling import ScalePoint, draw_frame, growth


@pytest.mark.parametrize(
    ("respect", "size", "chains", "crossings"),
    [("pixels", 0.1, 1, 0), ("length", 3, 1, 0), ("cables", 3, 3, 0), ("crossings", 3, 2, 3)],
)
def test_the_frame_shows_what_it_is_named_after(respect, size, chains, crossings):
    frame, mask, drawn = draw_frame(respect, size)
    detection = detect(frame, load_config("default"), mask)
    assert drawn == pytest.approx(size, rel=0.3)
    assert len(detection.chains) == chains
    assert len(detection.crossings) == crossings
    if respect == "pixels":
        assert frame.depth.size == pytest.approx(1e5, rel=0.01)
    if respect == "length":
        assert detection.chains[0].length == pytest.approx(drawn, rel=0.02)


def test_growth_is_the_exponent_at_the_end():
    points = [ScalePoint("cables", size, time, 1.0, 1) for size, time in ((1, 30), (2, 10), (4, 40))]
    assert growth(points) == pytest.approx(2)
