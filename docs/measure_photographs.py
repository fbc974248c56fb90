"""Measure photographs with nothing given against masks of cables: python docs/measure_photographs.py FOLDER [--set KEY=VALUE].

FOLDER holds images/ and masks/ with equal names. Printed are, as means over the photographs, the IoU of the segmentation's mask,
and of the chains drawn with their own width (those that `output.min_confidence` keeps); and the time of the method alone for the
photographs scaled to 1280 x 720 pixels: the median of the seconds of the processor.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cv2
import numpy as np

from doo3d import Image, load_config
from doo3d.evaluation.photos.score import drawn_pixels
from doo3d.pipeline import detect_with_stages
from doo3d.segment.methods import SEGMENTERS, resolve_method

TIMED_SIZE, TIMED_EVERY = (1280, 720), 5
"""px, and every so many photographs are timed."""


def intersection_over_union(found: np.ndarray, truth: np.ndarray) -> float:
    """Return the IoU of two masks (H, W) bool."""
    return float((found & truth).sum() / max(1, (found | truth).sum()))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting of doo3d")
    options = parser.parse_args()
    config = load_config("image", dict(each.split("=", 1) for each in options.set))
    rows, seconds = [], []
    for number, path in enumerate(sorted((options.folder / "images").iterdir())):
        color = np.ascontiguousarray(cv2.imread(str(path))[:, :, ::-1])
        truth = cv2.imread(str(next((options.folder / "masks").glob(f"{path.stem}.*")))).any(axis=2)
        detection, stages = detect_with_stages(Image(color), config)
        drawn = np.zeros(truth.shape, dtype=bool)
        for chain in detection.chains:
            if chain.confidence >= config.output.min_confidence:
                drawn |= drawn_pixels(chain, truth.shape)
        first = stages.observed.segmentation.base or stages.observed.segmentation  # before the mask was extended along the chains
        mask = np.asarray(first.scene.mask)
        rows.append((intersection_over_union(mask, truth), intersection_over_union(drawn, truth)))
        if number % TIMED_EVERY == 0:
            image = Image(cv2.resize(color, TIMED_SIZE))
            start = time.process_time()
            SEGMENTERS[resolve_method(image, config.segment)](image, config.segment, config.seed)
            seconds.append(time.process_time() - start)
    mask_iou, drawn_iou = np.mean(rows, axis=0)
    print(f"{len(rows)} photographs: IoU of the mask {mask_iou:.3f}, of the drawn chains {drawn_iou:.3f}")
    print(f"the method for 1280 x 720 pixels: {1000 * np.median(seconds):.0f} ms")


if __name__ == "__main__":
    main()
