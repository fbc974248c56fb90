"""Draw the pictures of docs/pages/troubleshooting.md: `python docs/figures/troubleshooting.py [NAME ...]`.

Each shows a failure on the left and the same frame with the remedy on the right. All frames are rendered or samples.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import Any

import cv2
import numpy as np
from figures import SAMPLES, beside, box_of, captioned, drawn, fit, save

import doo3d
from doo3d.evaluation.rendering.renderer import Rendered, render
from doo3d.evaluation.scenes.model import Scene, Solid, Table, Truth
from doo3d.evaluation.scenes.registry import make_scene
from doo3d.geometry.polyline import densify
from doo3d.inputs import open_capture
from doo3d.pipeline import run_stages
from doo3d.types import Camera, Detection, Frame, Image
from doo3d.viz.overlay import caption_lines

WIDTH, HEIGHT = 380, 240  # px, of a panel
MARGIN = 40  # px round the object
CAMERA = Camera(fx=920.0, fy=920.0, cx=640.0, cy=360.0, width=1280, height=720)
DISTANCE = 0.7  # m, from the camera to the table
TABLE = Table(np.array([0.0, 0.0, DISTANCE]), np.array([0.0, 0.0, -1.0]), (150, 152, 154))
LIGHT = (0.3, -0.4, -0.87)

YELLOW = [{"low": [15, 90, 60], "high": [32, 255, 255]}]  # HSV, of the cable in sample_clouds/crossing

Settings = Mapping[str, Any]


def pair(data: Frame | Image, box: tuple[slice, slice], *variants: tuple[str, Detection]) -> np.ndarray:
    """Return detections of the same data side by side, cut to the box, each below its caption."""
    panels = [captioned(fit(drawn(data, found)[box], WIDTH, HEIGHT), text) for text, found in variants]
    return beside(*panels)


def compared(
    rendered: Rendered,
    wrong: tuple[str, Settings],
    right: tuple[str, Settings],
    masks: tuple[Any, Any] = (None, None),
    margin: int = MARGIN,
) -> np.ndarray:
    """Return one rendered frame, detected with the wrong and with the right settings."""
    box = box_of(rendered.mask, margin, WIDTH / HEIGHT)
    found = [
        (text, doo3d.detect(rendered.frame, doo3d.load_config("default", settings), mask))
        for (text, settings), mask in zip((wrong, right), masks, strict=True)
    ]
    for text, detection in found:
        print("   ", text, "->", len(detection.chains), "chains", caption_lines(detection)[:3], detection.notes)
    return pair(rendered.frame, box, *found)


def color_range(rendered: Rendered) -> list[dict[str, list[int]]]:
    """Return the HSV range of the rendered cables' pixels, without the outermost 2 %."""
    hsv = cv2.cvtColor(np.asarray(rendered.frame.color), cv2.COLOR_RGB2HSV)[rendered.mask]
    low, high = np.percentile(hsv, (2, 98), axis=0).astype(int).tolist()
    return [{"low": [low[0], max(low[1] - 20, 0), max(low[2] - 30, 0)], "high": [high[0], 255, 255]}]


def own(cables: tuple[Truth, ...], solids: tuple[Solid, ...] = (), sensor: str = "d435") -> Rendered:
    """Return cables and solids above the table, rendered."""
    return render(Scene("own", "own", 0, CAMERA, cables, solids, TABLE, LIGHT), sensor)


def lying(points: Any, radius: float, color: tuple[int, int, int]) -> Truth:
    """Return a cable on the table along points (N, 2) m in the plane of the table, joined smoothly."""
    points = np.asarray(points, dtype=float)
    plane = np.column_stack((points, np.full(len(points), DISTANCE - radius)))
    return Truth(densify(plane, 0.0005), radius, color=color)


def block(size: tuple[float, float, float], middle: tuple[float, float, float]) -> Solid:
    """Return a box of a size in m about its middle (3,) m in the camera frame."""
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * size + middle
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    return Solid(corners, np.array([*faces, (1, 5, 7), (1, 7, 3)], dtype=np.int64), (48, 49, 52))


def nothing_found() -> np.ndarray:
    """A thin cable that the distance to the table does not tell from the table."""
    rendered = render(make_scene("thin", 3))
    return compared(
        rendered,
        ("segment.method=plane: nothing found", {"segment.method": "plane"}),
        ("segment.ranges from doo3d tune", {"segment.ranges": color_range(rendered)}),
    )


def table_found() -> np.ndarray:
    """A distance to the plane below the noise of the depth: bumps of the table are found, too."""
    rendered = render(make_scene("open", 9))
    return compared(
        rendered,
        ("segment.plane_distance=0.0007", {"segment.method": "plane", "segment.plane_distance": 0.0007}),
        ("segment.plane_distance=0.003", {"segment.method": "plane"}),
        margin=120,
    )


def clutter_found() -> np.ndarray:
    """Other things of the cable's color."""
    rendered = render(make_scene("clutter", 0))
    ranges = {"segment.ranges": color_range(rendered)}
    return compared(
        rendered,
        ("by color alone", ranges),
        ("merge.chains=1", {**ranges, "merge.chains": 1}),
        margin=90,
    )


def cables_joined() -> np.ndarray:
    """Two cables that end under one block: without their number they look like one."""
    turn = np.linspace(0, 0.5, 200)
    left = lying(np.column_stack((turn * 0.5 - 0.27, 0.03 * np.sin(8 * turn) + 0.02)), 0.004, (40, 150, 62))
    right = lying(np.column_stack((0.02 + turn * 0.5, 0.03 * np.sin(9 * turn) + 0.0)), 0.004, (40, 150, 62))
    rendered = own((left, right), (block((0.1, 0.09, 0.03), (0.0, 0.0, DISTANCE - 0.03)),))
    return compared(rendered, ("merge.chains=null", {}), ("merge.chains=2", {"merge.chains": 2}), margin=60)


def cable_in_pieces() -> np.ndarray:
    """A hidden stretch that is longer than merge.max_gap."""
    rendered = render(make_scene("occluded", 5))
    return compared(rendered, ("merge.max_gap=0.03", {"merge.max_gap": 0.03}), ("merge.max_gap=0.25", {}))


def wrong_scale() -> np.ndarray:
    """Depth of 1000 units per metre, read as 5000 per metre."""
    frame = open_capture(SAMPLES / "crossing").frames[0].load().data
    box = box_of(np.ptp(frame.color.astype(int), axis=2) > 60, MARGIN, WIDTH / HEIGHT)
    panels = []
    for scale in (5000, 1000):
        read = doo3d.Frame(frame.color, frame.depth * (1000 / scale), frame.camera)
        found = doo3d.detect(read, doo3d.load_config("default", {"segment.ranges": YELLOW}))
        text = f"depth_scale={scale}: " + (caption_lines(found) or ["nothing found"])[0]
        panels.append(captioned(fit(drawn(read, found)[box], WIDTH, HEIGHT), text))
    return beside(*panels)


def wrong_side() -> np.ndarray:
    """A loop hidden by a gripper: from the ends alone the short path looks as good as the true one."""
    turn = np.radians(np.linspace(225, -45, 400))
    arc = 0.05 * np.column_stack((np.cos(turn), -np.sin(turn)))
    out = 0.2 * np.array([np.sqrt(0.5), np.sqrt(0.5)])
    legs = [arc[0] + (1 - np.linspace(0, 1, 60)[:-1, None]) * out * (-1, 1), arc[-1] + np.linspace(0, 1, 60)[1:, None] * out]
    cable = lying(np.vstack((legs[0], arc, legs[1])), 0.004, (228, 112, 18))
    rendered = own((cable,), (block((0.17, 0.13, 0.03), (0.0, -0.02, DISTANCE - 0.03)),))
    found = doo3d.detect(rendered.frame, doo3d.load_config("default", {"merge.chains": 1}))
    box = box_of(rendered.mask, 130, WIDTH / HEIGHT)
    captions = "chain behind a gripper", "the same chain, gripper removed"
    frames = rendered.frame, own((cable,)).frame
    return beside(
        *(captioned(fit(drawn(frame, found)[box], WIDTH, HEIGHT), text) for frame, text in zip(frames, captions, strict=True))
    )


def mask_ragged() -> np.ndarray:
    """A mask with a frayed edge and specks, whose skeleton has spurs."""
    loaded = open_capture(SAMPLES / "photos/loop.jpg").frames[0].load()
    rng = np.random.default_rng(0)
    mask = np.asarray(loaded.mask, bool)
    edge = cv2.dilate(mask.astype(np.uint8), np.ones((9, 9))) > 0
    noise = cv2.GaussianBlur(rng.normal(size=mask.shape), (0, 0), 1.6)
    ragged = mask | (edge & (noise > 0.12))
    smooth = cv2.medianBlur(ragged.astype(np.uint8), 9) > 0
    smooth = cv2.morphologyEx(smooth.astype(np.uint8), cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (7, 7))) > 0
    panels = []
    for text, given, settings in (
        ("frayed mask", ragged, {}),
        ("the same mask, filtered", smooth, {}),
    ):
        stages = run_stages(loaded.data, doo3d.load_config("image", settings), given)
        picture = np.where(given[:, :, None], np.uint8(90), np.uint8(25)).repeat(3, axis=2)
        shown = drawn(Image(picture), Detection(tuple(stages.chains), mode="2d", coordinates="image"))
        print("   ", text, len(stages.chains), [round(c.length) for c in stages.chains])
        panels.append(captioned(fit(shown[box_of(mask, 15, WIDTH / HEIGHT)], WIDTH, HEIGHT), text))
    return beside(*panels)


def depth_holes() -> np.ndarray:
    """A shiny cable: the sensor has no depth along some of it."""
    rendered = render(make_scene("shiny", 7))
    return compared(
        rendered,
        ("by depth alone: the stretches without depth are guessed", {"segment.method": "plane"}),
        ("by color: holes are filled in", {"segment.ranges": color_range(rendered)}),
    )


def strands_touch() -> np.ndarray:
    """Two strands side by side: with all of the mask used they become one."""
    rendered = render(make_scene("hairpin", 3))
    return compared(
        rendered,
        ("voxelize.core_fraction=0", {"merge.chains": 1, "voxelize.core_fraction": 0.0}),
        ("voxelize.core_fraction=0.6", {"merge.chains": 1}),
        (rendered.mask, rendered.mask),
    )


PICTURES: dict[str, Callable[[], np.ndarray]] = {
    "nothing_found": nothing_found,
    "table_found": table_found,
    "clutter_found": clutter_found,
    "cables_joined": cables_joined,
    "cable_in_pieces": cable_in_pieces,
    "wrong_scale": wrong_scale,
    "wrong_side": wrong_side,
    "mask_ragged": mask_ragged,
    "depth_holes": depth_holes,
    "strands_touch": strands_touch,
}


if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        print(name)
        save(PICTURES[name](), "troubleshooting", name)
