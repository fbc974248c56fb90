"""Draw paper_2d.png, the failures of the paper's rules on wide cables: `python docs/figures/paper_2d.py [FILE]`.

Left the preset paper_2d, right the preset image, one chain wanted of either. The cables are drawn by this script.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from doo3d import Image, detect, load_config
from doo3d.viz import draw

IMAGES = Path(__file__).parents[1] / "pages" / "images"
WIDTH, TAIL = 25, 230  # px, of the cable, and how long its ends are
SIZE = (400, 480)  # px, height and width
LOOPS = ((55, 140), (75, 110))  # px, radius of a loop, and degrees between the strands below it


def mask(radius: float, degrees: float) -> np.ndarray:
    """(H, W) bool: a cable that goes once round a circle and crosses itself below it."""
    half = np.radians(degrees) / 2
    middle = np.array([SIZE[1] / 2, 20.0 + radius])
    crossing = middle + np.array([0.0, radius / np.sin(half)])
    turn = np.linspace(half, -np.pi - half, 400)  # between the points where the strands touch the circle
    loop = middle + radius * np.column_stack((np.cos(turn), np.sin(turn)))
    ends = crossing + TAIL * np.array([(-np.sin(half), np.cos(half)), (np.sin(half), np.cos(half))])
    line = np.vstack((ends[:1], crossing, loop, crossing, ends[1:]))
    drawn = np.zeros(SIZE, np.uint8)
    cv2.polylines(drawn, [np.round(line * 16).astype(np.int32)], False, (1,), WIDTH, shift=4)
    return np.asarray(drawn > 0)


def pictures(cable: np.ndarray) -> np.ndarray:
    """(H, 2 W, 3) RGB: both presets' chains over a cable."""
    image = Image(np.where(cable[:, :, None], (150, 150, 150), (40, 40, 40)).astype(np.uint8))
    found = [detect(image, load_config(preset, {"merge.chains": 1}), cable) for preset in ("paper_2d", "image")]
    return np.hstack([draw(image, detection) for detection in found])


if __name__ == "__main__":
    picture = np.vstack([pictures(mask(*loop)) for loop in LOOPS])
    picture = cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    cv2.imwrite(sys.argv[1] if len(sys.argv) > 1 else str(IMAGES / "paper_2d.png"), picture[:, :, ::-1])
