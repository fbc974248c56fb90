"""Draw one small picture per row of the table in docs/pages/choose.md: `python docs/figures/choose.py [NAME ...]`.

Everything shown is a sample of this project or a scene that it renders.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
from figures import SAMPLES, box_of, drawn, fit, save

import doo3d
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.model import Scene, Table, Truth
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.geometry.polyline import densify
from doo3d.inputs import open_capture
from doo3d.types import Camera

WIDTH, HEIGHT = 240, 150  # px
MARGIN = 25  # px of a 1280 px wide image round the object
CAMERA = Camera(fx=920.0, fy=920.0, cx=640.0, cy=360.0, width=1280, height=720)
DISTANCE = 0.8  # m, from the camera to the table
TABLE = Table(np.array([0.0, 0.0, DISTANCE]), np.array([0.0, 0.0, -1.0]), (150, 152, 154))
LIGHT = (0.3, -0.4, -0.87)


def sample(name: str, preset: str = "default", settings: dict | None = None, own_mask: bool = True) -> np.ndarray:
    """Return the picture of a sample's first frame, detected with a preset and settings."""
    loaded = open_capture(SAMPLES / name).frames[0].load()
    detection = doo3d.detect(loaded.data, doo3d.load_config(preset, settings or {}), loaded.mask if own_mask else None)
    return cropped(drawn(loaded.data, detection), loaded.data)


def cropped(picture: np.ndarray, data: doo3d.Frame | doo3d.Cloud | doo3d.Image) -> np.ndarray:
    """Return the part of a frame's picture where the object is: what has a color, or for clouds what is not background."""
    color = picture if isinstance(data, doo3d.Cloud) else np.asarray(data.color)
    colorful = np.ptp(color.astype(int), axis=2) > 60
    small = cv2.morphologyEx(colorful.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0
    return picture[box_of(small if small.any() else colorful, MARGIN, WIDTH / HEIGHT)]


def scene(family: str, seed: int, settings: dict, preset: str = "default") -> np.ndarray:
    """Return the picture of a rendered scene, detected with its mask."""
    rendered = render(make_scene(family, seed))
    detection = doo3d.detect(rendered.frame, doo3d.load_config(preset, settings), rendered.mask)
    return drawn(rendered.frame, detection)[box_of(rendered.mask, MARGIN, WIDTH / HEIGHT)]


def own_scene(cables: tuple[Truth, ...], preset: str, settings: dict) -> np.ndarray:
    """Return the picture of cables above a table, detected with their mask."""
    rendered = render(Scene("own", "own", 0, CAMERA, cables, (), TABLE, LIGHT))
    detection = doo3d.detect(rendered.frame, doo3d.load_config(preset, settings), rendered.mask)
    return drawn(rendered.frame, detection)[box_of(rendered.mask, MARGIN, WIDTH / HEIGHT)]


def tubes() -> np.ndarray:
    """Return the picture of five straight tubes in a pile, each above those before it."""
    rng, radius, found = np.random.default_rng(3), 0.012, []
    for level in range(5):
        angle = level * np.pi / 5 + rng.uniform(-0.2, 0.2)
        along = np.array([np.cos(angle), np.sin(angle), 0.0])
        middle = np.array([*rng.uniform(-0.05, 0.05, 2), DISTANCE - radius - 2.05 * radius * level])
        ends = np.array([middle - 0.17 * along, middle + 0.17 * along])
        found.append(Truth(densify(ends, 0.0005), radius, color=(28, 92, 196)))
    return own_scene(tuple(found), "tubes", {})


def ring() -> np.ndarray:
    """Return the picture of a closed belt on a table."""
    turn = np.linspace(0, 2 * np.pi, 2400, endpoint=False)
    reach = 0.13 + 0.03 * np.cos(3 * turn)
    axis = np.column_stack((1.4 * reach * np.cos(turn), reach * np.sin(turn), np.full(len(turn), DISTANCE - 0.005)))
    return own_scene((Truth(axis, 0.005, closed=True, color=(40, 150, 62)),), "default", {"merge.allow_closed_chains": True})


def clutter() -> np.ndarray:
    """Return the picture of a colored cable among other things, told by its color."""
    rendered = render(make_scene("clutter", 4))
    hue = cv2.cvtColor(np.asarray(rendered.frame.color), cv2.COLOR_RGB2HSV)[rendered.mask]
    low, high = np.percentile(hue, (2, 98), axis=0).astype(int).tolist()
    settings = {"segment.ranges": [{"low": [low[0], low[1], max(low[2] - 20, 0)], "high": [high[0], 255, 255]}]}
    detection = doo3d.detect(rendered.frame, doo3d.load_config("default", {**settings, "merge.chains": 1}))
    return drawn(rendered.frame, detection)[box_of(rendered.mask, 60, WIDTH / HEIGHT)]


def background() -> np.ndarray:
    """Return the picture of a cable before a scene of which a reference frame without the cable is known."""
    made = make_scene("occluded", 1)
    with_cable, without = render(made), render(replace(made, cables=()))
    mask = np.abs(with_cable.frame.color.astype(int) - without.frame.color.astype(int)).max(axis=2) > 40
    mask = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0
    detection = doo3d.detect(with_cable.frame, doo3d.load_config("default", {"merge.chains": 1}), mask & with_cable.mask)
    return drawn(with_cable.frame, detection)[box_of(with_cable.mask, MARGIN, WIDTH / HEIGHT)]


def fused() -> np.ndarray:
    """Return both frames of the occluder sample, each half as wide: the views that fusing takes together."""
    frames = [entry.load().data for entry in open_capture(SAMPLES / "occluder").frames[:2]]
    pictures = [drawn(frame, doo3d.detect(frame, doo3d.load_config("default", {"merge.chains": 1}))) for frame in frames]
    halves = [fit(cropped(picture, frame), WIDTH // 2 - 2, HEIGHT) for picture, frame in zip(pictures, frames, strict=True)]
    return np.hstack((halves[0], np.full((HEIGHT, 4, 3), 255, np.uint8), halves[1]))


PICTURES: dict[str, Callable[[], np.ndarray]] = {
    "table": lambda: sample("crossing"),
    "several": lambda: sample("two_cables", settings={"merge.chains": 2}),
    "color": clutter,
    "background": background,
    "mask": lambda: scene("knots", 4, {"merge.chains": 1}),
    "air": lambda: sample("helix"),
    "cloud": lambda: sample("clouds/crossing.ply"),
    "cloud_on_table": lambda: sample("clouds/on_table.ply"),
    "thin": lambda: scene("thin", 3, {"merge.chains": 1}),
    "ring": ring,
    "tubes": tubes,
    "harness": lambda: scene("tree_crossing", 0, {}, "harness"),
    "fused": fused,
    "photo": lambda: sample("photos/tangle.jpg", "image"),
    "photo_without_mask": lambda: sample("photos/loop.jpg", "image", own_mask=False),
    "paper_2d": lambda: sample("photos/loop.jpg", "paper_2d"),
    "paper_3d": lambda: sample("crossing", "paper_3d"),
}


if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        save(fit(PICTURES[name](), WIDTH, HEIGHT), "choose", name)
