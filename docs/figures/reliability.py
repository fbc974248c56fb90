"""Draw the reliability of the confidence: python docs/figures/reliability.py [OUT.png] [--rows FILE ...].

The rows are files written by `doo3d evaluate scenes ... --csv FILE`; by default docs/figures/reliability.csv, which holds their
columns frame, confidence, correct and image_correct for the frames that docs/pages/accuracy-scoring.md names. For each bin of
confidence the picture shows the share of frames that are correct (filled) and right in the image (open), with the interval in
which the true share lies with 90 % (Wilson), over the mean confidence; on the diagonal, a confidence is worth what it says.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import cv2
import numpy as np

from doo3d.evaluation.metrics.confidence import RELIABILITY_BINS

HERE = Path(__file__).resolve().parent
ROWS, PICTURE = HERE / "reliability.csv", HERE.parent / "pages" / "images" / "reliability.png"
SIZE, MARGIN, LEFT = 520, 60, 80  # px
STRICT, IMAGE, GREY, TEXT = (180, 90, 20), (40, 130, 230), (200, 200, 200), (40, 40, 40)  # BGR
Z = 1.645  # standard deviations of 90 %


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="?", type=Path, default=PICTURE)
    parser.add_argument("--rows", nargs="+", type=Path, default=[ROWS])
    options = parser.parse_args()
    confidence, correct, in_image = read(options.rows)
    cv2.imwrite(str(options.out), draw(confidence, correct, in_image))


def read(paths: list[Path]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return confidence, correct and right in the image of every frame of CSV files, (F,) each."""
    rows = [row for path in paths for row in csv.DictReader(path.open(encoding="utf-8"))]
    flags = [[row[name] == "True" for row in rows] for name in ("correct", "image_correct")]
    return np.array([float(row["confidence"]) for row in rows]), np.array(flags[0]), np.array(flags[1])


def draw(confidence: np.ndarray, correct: np.ndarray, in_image: np.ndarray) -> np.ndarray:
    """Return the picture, (H, W, 3) uint8 BGR."""
    picture = np.full((SIZE + 2 * MARGIN, SIZE + MARGIN + LEFT, 3), 255, np.uint8)
    for share in np.linspace(0, 1, 6):
        cv2.line(picture, at(share, 0), at(share, 1), GREY, 1, cv2.LINE_AA)
        cv2.line(picture, at(0, share), at(1, share), GREY, 1, cv2.LINE_AA)
        write(picture, f"{share:.1f}", at(share, 0), (-12, 22))
        write(picture, f"{share:.0%}", at(0, share), (-48, 5))
    cv2.line(picture, at(0, 0), at(1, 1), (120, 120, 120), 1, cv2.LINE_AA)
    write(picture, "mean confidence of the frames", at(0.5, 0), (-110, 45))
    write(picture, "right frames", at(0, 1), (-70, -15))
    index = np.clip(np.searchsorted(RELIABILITY_BINS, confidence, side="right") - 1, 0, len(RELIABILITY_BINS) - 2)
    for right, color, offset, filled in ((in_image, IMAGE, 4, False), (correct, STRICT, -4, True)):
        for k in np.unique(index):
            chosen = index == k
            count, share, mean = int(chosen.sum()), float(right[chosen].mean()), float(confidence[chosen].mean())
            low, high = wilson(share, count)
            (x, y), top, bottom = at(mean, share), at(mean, high)[1], at(mean, low)[1]
            cv2.line(picture, (x + offset, top), (x + offset, bottom), color, 1, cv2.LINE_AA)
            cv2.circle(picture, (x + offset, y), 6, color if filled else (255, 255, 255), -1, cv2.LINE_AA)
            cv2.circle(picture, (x + offset, y), 6, color, 2, cv2.LINE_AA)
            if filled:
                write(picture, str(count), (x, at(0, min(low, mean))[1]), (-10, 20))
    for k, (name, color) in enumerate((("correct", STRICT), ("right in the image", IMAGE))):
        cv2.circle(picture, (LEFT + 300, MARGIN + SIZE - 60 + 24 * k), 6, color, -1 if not k else 2, cv2.LINE_AA)
        write(picture, name, (LEFT + 315, MARGIN + SIZE - 55 + 24 * k), (0, 0))
    return picture


def wilson(share: float, count: int) -> tuple[float, float]:
    """Return the interval (low, high) of a share that was seen in `count` frames (Wilson 1927)."""
    middle = (share + Z**2 / (2 * count)) / (1 + Z**2 / count)
    half = Z / (1 + Z**2 / count) * np.sqrt(share * (1 - share) / count + Z**2 / (4 * count**2))
    return float(max(middle - half, 0)), float(min(middle + half, 1))


def at(x: float, y: float) -> tuple[int, int]:
    """Return the pixel of a point of the plot, 0 to 1 in both."""
    return round(LEFT + SIZE * x), round(MARGIN + SIZE * (1 - y))


def write(picture: np.ndarray, text: str, where: tuple[int, int], offset: tuple[int, int]) -> None:
    """Write a text into the picture."""
    origin = (where[0] + offset[0], where[1] + offset[1])
    cv2.putText(picture, text, origin, cv2.FONT_HERSHEY_SIMPLEX, 0.45, TEXT, 1, cv2.LINE_AA)


if __name__ == "__main__":
    main()
