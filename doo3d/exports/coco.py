"""Export the pixels and evenly spaced points of all chains as annotations of COCO, for networks that are trained on images."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from ..types import Array, Bools, Detection
from ..types.view import HIDDEN
from .base import Export

CATEGORY = 1
"""Number of the only category, the cable."""

OUTSIDE, COVERED, VISIBLE = 0, 1, 2
"""COCO's flags of a keypoint: not labelled, labelled but hidden, labelled and visible."""


class Coco(Export):
    """Export format COCO: one JSON file of a capture with an annotation for each chain of each image.

    An annotation has the pixels of the chain (`segmentation`, run lengths compressed as pycocotools reads them), `bbox` and
    `area` in px, and M evenly spaced points of its axis as `keypoints`; M is the option `count`.
    """

    summary: ClassVar[str] = "masks and keypoints of the capture for COCO's tools; needs detect --instances"
    suffixes: ClassVar[tuple[str, ...]] = (".json",)
    file_per: ClassVar[Any] = "capture"
    supports_2d: ClassVar[bool] = True

    count: int = Field(14, ge=2, description="number of keypoints, M")
    image_suffix: str = Field(".jpg", description="end of the images' file names, which begin with the names of the frames")

    def write(self, frames: Sequence[Detection], path: Path) -> None:
        """Write `images`, `annotations` and `categories` of all frames, numbered from 1.

        The flag of a keypoint is 2 if it is seen, 1 if it is hidden, and 0, with x and y 0, if it is not in the image.
        Coordinates are px; 0, 0 is the center of the first pixel. Besides COCO's keys, an annotation has `confidence` and, if the
        chain has an id, `track_id`.

        Raises
        ------
        InputError : the instance labels of a frame are missing.
        """
        images: list[dict[str, Any]] = []
        annotations: list[dict[str, Any]] = []
        for number, frame in enumerate(frames, 1):
            labels = frame.instance_labels()
            height, width = labels.shape
            images.append({"id": number, "file_name": frame.frame + self.image_suffix, "width": width, "height": height})
            for k, chain in enumerate(frame.chains):
                head = {"id": len(annotations) + 1, "image_id": number, "category_id": CATEGORY, "iscrowd": 0}
                tail = {"confidence": chain.confidence} | ({} if chain.id is None else {"track_id": chain.id})
                annotations.append(head | _pixels(labels == k + 1) | self._keypoints(frame, k) | tail)
        nodes = {"keypoints": [f"node{k}" for k in range(self.count)], "skeleton": [[k, k + 1] for k in range(1, self.count)]}
        category = {"id": CATEGORY, "name": "cable", "supercategory": "cable"} | nodes
        content = {"images": images, "annotations": annotations, "categories": [category]}
        path.write_text(json.dumps(content, allow_nan=False) + "\n", encoding="utf-8")

    def _keypoints(self, frame: Detection, number: int) -> dict[str, Any]:
        view, chain = frame.view, frame.in_camera().chains[number]
        assert view is not None
        nodes, nearest = chain.nodes(self.count), np.rint(np.linspace(0, len(chain.joints) - 1, self.count)).astype(int)
        is_hidden = np.array(frame.visibility(number))[nearest] == HIDDEN
        flags = np.where(view.is_outside(nodes), OUTSIDE, np.where(is_hidden, COVERED, VISIBLE))
        pixels = np.where(flags[:, None] == OUTSIDE, 0.0, view.project(nodes))
        values = [value for (u, v), flag in zip(pixels.tolist(), flags.tolist(), strict=True) for value in (u, v, flag)]
        return {"keypoints": values, "num_keypoints": int(np.count_nonzero(flags))}


def _pixels(mask: Bools) -> dict[str, Any]:
    """Return the keys `segmentation`, `area` and `bbox` (x, y, width, height) of a mask (H, W)."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    box = [0, 0, 0, 0]
    if len(rows):
        left, top = int(columns[0]), int(rows[0])
        box = [left, top, int(columns[-1]) + 1 - left, int(rows[-1]) + 1 - top]
    counts = {"size": list(mask.shape), "counts": compressed(run_lengths(mask))}
    return {"segmentation": counts, "area": int(np.count_nonzero(mask)), "bbox": box}


def run_lengths(mask: Bools) -> list[int]:
    """Return the lengths of the runs of a mask (H, W), column by column, those without and with the object in turn."""
    pixels: Array = np.concatenate(([False], mask.T.ravel()))
    edges = np.flatnonzero(pixels[1:] != pixels[:-1])
    return [int(length) for length in np.diff(np.concatenate(([0], edges, [mask.size])))]


def compressed(counts: Sequence[int]) -> str:
    """Return run lengths as the text of pycocotools (`rleToString` in its maskApi.c).

    From the fourth on, the length before the last one is subtracted from a length. A number is written by 5 bits at a time, the
    lowest first, in two's complement; a sixth bit says that more follow.
    """
    text = []
    for k, count in enumerate(counts):
        value = count - counts[k - 2] if k > 2 else count
        more = True
        while more:
            bits, value = value & 0x1F, value >> 5
            more = value != (-1 if bits & 0x10 else 0)
            text.append(chr(48 + bits + 0x20 * more))
    return "".join(text)
