"""Predict with the initialization of TrackDLO (Xiang et al., RA-L 2023): python docs/benchmark_trackdlo.py CHECKOUT SET FOLDER.

CHECKOUT is a clone of github.com/RMDLO/trackdlo; the Python that runs this file needs numpy, scipy, opencv-python, pillow and
scikit-image 0.20 or older, and no ROS. SET is a set of frames of `doo3d evaluate sets`. Its steps trace the mask, look up depth,
and fit one spline (s = 0.0005) through all pieces: it is made for a single object. The predictions go to FOLDER, for
`doo3d evaluate predictions FOLDER --data SET`. A frame on which it fails gets no file, and counts as an empty prediction.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
from scipy import interpolate

NODES = 40
"""Number of nodes, as in the launch file of TrackDLO's evaluation."""

WIDTH = 1280
"""Width in px of the images that its filters are made for; smaller masks are enlarged, or its mode filter erases thin strands."""


def nodes_of(trace, mask: np.ndarray, depth: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return the nodes (NODES, 3) in m in the camera's optical frame, by the steps of TrackDLO's initialization."""
    scale = -(-WIDTH // mask.shape[1])
    mask = cv2.resize(mask, None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    chains = trace(False, cv2.cvtColor(mask, cv2.COLOR_GRAY2BGR), img_scale=1, seg_length=8, max_curvature=25)
    x, y = np.array([point for chain in chains for point in chain]).astype(int).T // scale
    z = depth[y, x] / 1000.0
    points = np.column_stack([(x - matrix[0, 2]) * z / matrix[0, 0], (y - matrix[1, 2]) * z / matrix[1, 1], z])[z > 0]
    spline, _ = interpolate.splprep(points.T, s=0.0005)
    curve = np.column_stack(interpolate.splev(np.linspace(0, 1, 1000), spline))
    return curve[np.linspace(0, len(curve) - 1, NODES).astype(int)]


def main(checkout: Path, data: Path, folder: Path) -> None:
    """Predict every frame of the captures in `data`."""
    messages = ModuleType("visualization_msgs.msg")  # utils.py names these two for its markers in ROS, which are not drawn here
    vars(messages).update(Marker=None, MarkerArray=None)
    sys.modules["visualization_msgs"] = ModuleType("visualization_msgs")
    sys.modules["visualization_msgs.msg"] = messages
    sys.path.insert(0, str(checkout / "trackdlo" / "src"))
    from utils import extract_connected_skeleton

    cv2.setNumThreads(1)
    failed = []
    for file in sorted(data.glob("*/mask/*.png")):
        capture, name = file.parent.parent, f"{file.parent.parent.name}/{file.stem}"
        mask = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        depth = cv2.imread(str(capture / "depth" / file.name), cv2.IMREAD_UNCHANGED)
        camera = json.loads((capture / "camera_intrinsic.json").read_text())
        matrix = np.reshape(camera["intrinsic_matrix"], (3, 3)).T  # Open3D writes it by columns
        start = time.perf_counter()
        try:
            nodes = nodes_of(extract_connected_skeleton, 255 * (mask > 0).astype(np.uint8), depth, matrix)
        except Exception as error:
            failed.append(f"{name}: {type(error).__name__}: {error}")
            continue
        ms = 1e3 * (time.perf_counter() - start)
        path = folder / f"{name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"chains": [{"points": nodes.tolist()}], "ms": ms}))
    print(f"{len(failed)} failed", *failed, sep="\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:4]))
