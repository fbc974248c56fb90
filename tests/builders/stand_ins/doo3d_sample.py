"""The frames that the stand-ins of drivers give: those of the sample "crossing"."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np

FOLDER = Path(__file__).resolve().parents[3] / "sample_clouds" / "crossing"
INTRINSICS = json.loads((FOLDER / "camera_intrinsic.json").read_text())
FX, FY, CX, CY = (INTRINSICS["intrinsic_matrix"][i] for i in (0, 4, 6, 7))
WIDTH, HEIGHT = INTRINSICS["width"], INTRINSICS["height"]
COUNT = 3


def color(number: int) -> np.ndarray:
    """(H, W, 3) uint8 RGB."""
    return cv2.cvtColor(cv2.imread(str(sorted((FOLDER / "color").iterdir())[number])), cv2.COLOR_BGR2RGB)


def depth(number: int) -> np.ndarray:
    """(H, W) uint16 mm."""
    raw = cv2.imread(str(sorted((FOLDER / "depth").iterdir())[number]), cv2.IMREAD_UNCHANGED)
    return np.rint(raw * (1000 / INTRINSICS.get("depth_scale", 1000))).astype(np.uint16)
