"""Depth that is not metric, or not along the optical axis: each kind is noted, with its name, and metric depth is not."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.paths import SAMPLES

import doo3d
from doo3d.inputs import open_capture
from doo3d.types import Camera, Chain, Frame, Plane
from doo3d.types.plausibility import frame_notes, topic_of

CAMERA = Camera(180.0, 180.0, 159.5, 119.5, 320, 240)
RADIUS = 0.006


def tabletop(tilt: float = 0.4, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the depth (240, 320) m of a tilted table with a straight cable on it, and the two ends of the cable's axis."""
    v, u = np.mgrid[:240, :320]
    x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
    table = 0.5 / (1 + tilt * y)
    width = np.abs(y * table) / RADIUS
    cable = np.sqrt(np.clip(1 - width**2, 0, 1)) * RADIUS + RADIUS * (width < 1)
    depth = table - cable * (np.abs(x) < 0.6) + noise * np.random.default_rng(0).standard_normal(table.shape)
    return depth, np.array([[-0.29, 0.0, 0.5 - RADIUS], [0.29, 0.0, 0.5 - RADIUS]])


def notes_on(depth: np.ndarray, width_at: float) -> tuple[str, ...]:
    """Return the notes on a frame with these values, the chain and the plane of which are where the values put them."""
    scale = width_at / 0.5
    chain = Chain(tabletop()[1] * scale, 0.58 * scale, RADIUS * scale)
    plane = Plane(np.array([0.0, 0.0, -1.0]), -width_at)
    return frame_notes(Frame(None, depth, CAMERA), (chain_of(chain),), plane)


def chain_of(chain: Chain) -> Chain:
    """Return a chain of 40 segments between the ends of another."""
    return Chain(np.linspace(chain.joints[0], chain.joints[-1], 41), chain.length / 40, chain.radius)


@pytest.mark.parametrize("noise", [0.0, 0.0005])
def test_metric_depth_has_no_note(noise):
    assert notes_on(tabletop(0.0, noise)[0], 0.5) == ()
    assert notes_on(np.rint(1000 * tabletop(0.4, noise)[0]) / 1000, 0.5) == ()


@pytest.mark.parametrize("noise", [0.0, 0.0005])
def test_distances_along_the_rays(noise):
    depth = tabletop(0.4, noise)[0]
    rays = np.linalg.norm(
        np.dstack(
            np.broadcast_arrays(*np.ix_((np.arange(240) - CAMERA.cy) / CAMERA.fy, (np.arange(320) - CAMERA.cx) / CAMERA.fx), 1.0)
        ),
        axis=2,
    )
    (note,) = notes_on(depth * rays, 0.5)
    assert re.search(r"check the depth: the broadest surface is bent by \d+\.\d% of its depth, and flat to 0\.[0-3]%", note)


@pytest.mark.parametrize(
    ("convert", "words"),
    [
        (lambda z: 3.1 * (z - 0.1) / z / 3.0, "as in a renderer's depth buffer"),
        (lambda z: 10 * (z - 0.01) / z / 9.99, "as in a renderer's depth buffer"),
        (lambda z: 0.1 / z, "as in disparities"),
    ],
)
def test_values_that_are_no_metres(convert, words):
    depth = tabletop(0.0)[0]
    values = convert(depth)
    (note,) = (each for each in notes_on(values, float(np.median(values))) if topic_of(each) == "depth")
    assert words in note


def test_normalized_depth():
    depth = tabletop(0.4)[0]
    (note,) = frame_notes(Frame(None, (depth - depth.min()) / np.ptp(depth), CAMERA), ())
    assert "the values range from 0 to exactly 1" in note


@pytest.mark.slow
@pytest.mark.parametrize("name", ["crossing", "straight", "occluder"])
def test_a_depth_buffer_end_to_end(name):
    frame = open_capture(SAMPLES / name).frames[0].load().data
    assert not [note for note in doo3d.detect(frame).notes if note.startswith("check")]
    depth = frame.depth.astype(float)
    values = np.where(depth > 0, 3.1 * (depth - 0.1) / np.maximum(depth, 0.1) / 3.0, 0.0)
    notes = doo3d.detect(replace(frame, depth=values)).notes
    assert [topic_of(note) for note in notes if note.startswith("check")] == ["depth"]
