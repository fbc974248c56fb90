"""Draw the pictures of the README from the results of its commands: `python docs/figures/moving.py MOVING HARNESS`.

MOVING is the folder that `doo3d detect sample_clouds/hand --sequence` wrote, HARNESS that of `sample_clouds/t_piece`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
from figures import IMAGES, SAMPLES, beside, fit, save

FRAME_MS, LAST_MS = 140, 900  # ms that a frame of the moving picture is shown, and its last one
WIDTH, HEIGHT = 560, 315  # px of a panel of the moving picture
STILL_WIDTH, STILL_HEIGHT = 480, 270  # px of a panel of the other
WEBP_QUALITY = 62


def panels(capture: str, results: Path, frame: str, width: int, height: int) -> np.ndarray:
    """Return the camera's image of a frame beside the picture that the detection made of it, (H, W, 3) RGB."""
    files = SAMPLES / capture / "color" / f"{frame}.jpg", results / f"{frame}.jpg"
    return beside(*(fit(cv2.imread(str(file))[:, :, ::-1], width, height) for file in files))


def main() -> None:
    moving, harness = (Path(folder) for folder in sys.argv[1:])
    names = [path.stem for path in sorted((SAMPLES / "hand" / "color").iterdir())]
    animation = cv2.Animation()  # repeated for ever
    animation.frames = [np.ascontiguousarray(panels("hand", moving, name, WIDTH, HEIGHT)[:, :, ::-1]) for name in names]
    animation.durations = np.array([FRAME_MS] * (len(names) - 1) + [LAST_MS])
    cv2.imwriteanimation(str(IMAGES / "moving.webp"), animation, [cv2.IMWRITE_WEBP_QUALITY, WEBP_QUALITY])
    save(panels("t_piece", harness, "000000", STILL_WIDTH, STILL_HEIGHT), "", "t_piece")


if __name__ == "__main__":
    main()
