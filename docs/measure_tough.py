"""Compare the tough families with scenes of another hand: python docs/measure_tough.py DIR [--seeds 8] [--cache FOLDER].

DIR holds the frames of the other hand: `<family>_<k>/` is a capture with color, depth and the true mask; its
`other/depth_simple.png` is depth with simple noise, its `other/mask_ragged.png` a mask as a network gives it, and its `truth.npz`
the axes and the radii. Printed are, for both and family by family, the share of frames that are correct by the strict rule and in
the image, for each sensor and each kind of mask; and the properties that make the scenes hard. `--cache` keeps the rendered
frames, `--csv` writes a line per frame, `--start` names the first seed.
"""

from __future__ import annotations

import argparse
import csv
import pickle
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial import cKDTree

from doo3d import detect, load_config, open_capture
from doo3d.errors import DooError
from doo3d.evaluation.benchmark.cases import KnownFrame, scene_cases
from doo3d.evaluation.metrics.score import score
from doo3d.evaluation.rendering.ragged_mask import ragged_mask
from doo3d.evaluation.scenes.model import Truth
from doo3d.evaluation.scenes.registry import GROUPS, family_rng
from doo3d.types import Bools, Floats, Ints

SENSORS = {"stereo": "coarse", "simple": "d435"}
"""Depth of the other hand, and the simulated sensor that it is compared with."""

MASKS, COUNTS, RULES = ("true", "ragged", "no"), ("given", "left open"), ("strict", "image")
SOURCES = ("theirs", "ours")
FAR_M = 0.010
"""m by which a depth is wrong."""

TOUCH, OWN_ARC_RADII, POINT_SPACING = 1.15, 8, 0.001
"""Sums of radii within which two strands touch; radii along a cable within which its points are one strand; m between points."""

PROPERTIES = (
    "radius, mm",
    "length, m",
    "least depth, m",
    "span of depth, m",
    "width, px",
    "hidden, %",
    "touching, %",
    "no depth, %",
    "depth behind, mm",
    "off by 10 mm, %",
)
"""Of the cables, the last three of the middle of their pixels: without depth, its median error, and the share that is wrong."""

Row = dict[str, Any]
"""What is known of a frame: name -> value."""


@dataclass(frozen=True)
class Given:
    """A frame of one sensor, and its ragged mask."""

    source: str
    family: str
    name: str
    sensor: str
    known: KnownFrame
    ragged: Bools


def shared_frames(folder: Path) -> Iterator[Given]:
    """Read the frames of the other hand."""
    for path in sorted(folder.glob("*_?")):
        loaded, truth = open_capture(path).frames[0].load(), np.load(path / "truth.npz")
        axes = [truth[f"axis_{k}"].astype(float) for k in range(len(truth["radii"]))]
        truths = tuple(Truth(*each) for each in zip(axes, truth["radii"].tolist(), truth["closed"].tolist(), strict=True))
        simple = cv2.imread(str(path / "other/depth_simple.png"), cv2.IMREAD_UNCHANGED) / np.float32(1e4)
        ragged = cv2.imread(str(path / "other/mask_ragged.png"), cv2.IMREAD_GRAYSCALE) > 0
        for sensor, frame in (("stereo", loaded.data), ("simple", replace(loaded.data, depth=simple))):
            yield Given("theirs", path.name[:-2], path.name, sensor, KnownFrame(frame, truths, loaded.mask), ragged)


def rendered_frames(families: list[str], seeds: range, cache: Path | None) -> Iterator[Given]:
    """Render scenes of families, or take them from the cache."""
    for sensor, simulated in SENSORS.items():
        for case in scene_cases(families, seeds, simulated):
            file = None if cache is None else cache / f"{simulated}_{case.name}.pkl"
            known = pickle.loads(file.read_bytes()) if file is not None and file.exists() else case.load()
            if file is not None and not file.exists():
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(pickle.dumps(known))
            ragged = ragged_mask(known.mask, family_rng(f"{case.name}/ragged", 0))
            yield Given("ours", case.family.removeprefix("tough_"), case.name, sensor, known, ragged)


def rates(given: Given) -> Row:
    """Return whether a frame is correct, and correct in the image, for each kind of mask, the number of cables given or left."""
    result = {}
    frame, truths = given.known.data, given.known.truths
    for mask, pixels in zip(MASKS, (given.known.mask, given.ragged, None), strict=True):
        for count, number in zip(COUNTS, (len(truths), None), strict=True):
            try:
                chains = detect(frame, load_config("default", {"merge.chains": number}), pixels).chains
            except DooError:
                chains = ()
            found = score(chains, truths, None, frame.camera)
            result |= {f"{mask} {count} {RULES[0]}": found.correct, f"{mask} {count} {RULES[1]}": bool(found.image_correct)}
    return result


def properties(given: Given) -> Row:
    """Return what makes a frame hard: of the cables, of the view, and of the depth on them."""
    frame, truths = given.known.data, given.known.truths
    axes = [truth.axis[:: max(round(POINT_SPACING / truth.spacing), 1)] for truth in truths]
    points, counts = np.vstack(axes), [len(axis) for axis in axes]
    strand, radius = np.repeat(np.arange(len(truths)), counts), np.repeat([truth.radius for truth in truths], counts)
    pixels, width = frame.camera.project(points), 2 * radius * frame.camera.fx / points[:, 2]
    v, u = np.nonzero(given.known.mask)
    distance, nearest = cKDTree(pixels).query(np.column_stack((u, v)))
    core = distance < 0.6 * width[nearest]
    depth, nearest = frame.depth[v, u][core], nearest[core]
    front = points[nearest, 2] - radius[nearest] * np.sqrt(np.maximum(1 - (distance[core] / width[nearest]) ** 2, 0))
    error = (depth - front)[depth > 0]
    touching, hidden = _contacts(points, strand, radius, pixels, width)
    x, y = np.clip(np.round(pixels).astype(int), 0, (frame.camera.width - 1, frame.camera.height - 1)).T
    values = (
        1e3 * radius.mean(),
        float(np.mean([truth.length for truth in truths])),
        points[:, 2].min(),
        np.ptp(points[:, 2]),
        np.median(width),
        100 * np.mean(hidden | ~given.known.mask[y, x]),
        100 * touching.mean(),
        100 * np.mean(depth <= 0),
        1e3 * np.median(error),
        100 * np.mean(np.abs(error) > FAR_M),
    )
    return dict(zip(PROPERTIES, values, strict=True))


def _contacts(points: Floats, strand: Ints, radius: Floats, pixels: Floats, width: Floats) -> tuple[Bools, Bools]:
    """Return which points touch another strand, and which points another strand hides, (P,) each."""
    away = OWN_ARC_RADII * radius.max() / POINT_SPACING
    touching, hidden = np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    for tree, reach in ((cKDTree(points), 3 * radius.max()), (cKDTree(pixels), float(width.max()) / 2)):
        i, j = tree.query_pairs(reach, output_type="ndarray").T
        i, j = np.r_[i, j], np.r_[j, i]
        other = (strand[i] != strand[j]) | (np.abs(i - j) > away)
        i, j = i[other], j[other]
        touching[i[np.linalg.norm(points[i] - points[j], axis=1) < TOUCH * (radius[i] + radius[j])]] = True
        beside = np.linalg.norm(pixels[i] - pixels[j], axis=1) < width[j] / 2
        hidden[i[beside & (points[j, 2] < points[i, 2] - radius[i] / 2)]] = True
    return touching, hidden


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="?", help="folder of the frames of the other hand")
    parser.add_argument("--families", default=",".join(GROUPS["tough"]), help="rendered families, separated by commas")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--start", type=int, default=0)
    parser.add_argument("--cache", type=Path, help="folder of rendered frames, kept between calls")
    parser.add_argument("--csv", type=Path, help="write a line per frame to this file")
    options = parser.parse_args()
    families = [name for name in options.families.split(",") if name]
    shared = shared_frames(options.data) if options.data else ()
    ours = rendered_frames(families, range(options.start, options.start + options.seeds), options.cache)
    rows = []
    for given in chain(shared, ours):
        known = {"source": given.source, "family": given.family, "name": given.name, "sensor": given.sensor}
        rows.append(known | rates(given) | properties(given))
        print(" ".join(known.values()), "".join(".+"[rows[-1][f"{mask} given {RULES[0]}"]] for mask in MASKS), flush=True)
    print(rate_tables(rows) + "\n\n" + property_table(rows))
    if options.csv:
        with options.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)


def rate_tables(rows: list[Row]) -> str:
    """Return the shares of correct frames, a table with the number of cables given and one without."""
    lines = []
    for count in COUNTS:
        heads = [f"{mask} mask, {source}" for mask in MASKS for source in SOURCES]
        lines += [f"\nNumber of cables {count}: correct / right in the image, %\n", _line("family", "depth", *heads)]
        lines.append(_line(*["---"] * (len(heads) + 2)))
        for family, sensor in [*_groups(rows), *(("all", sensor) for sensor in SENSORS)]:
            part = [row for row in rows if row["sensor"] == sensor and family in ("all", row["family"])]
            cells = [_shares([row for row in part if row["source"] == s], f"{m} {count}") for m in MASKS for s in SOURCES]
            lines.append(_line(family, sensor, *cells))
    return "\n".join(lines)


def property_table(rows: list[Row]) -> str:
    """Return the medians of the properties, those of the other hand before ours."""
    lines = [_line("family", "depth", *PROPERTIES), _line(*["---"] * (len(PROPERTIES) + 2))]
    for family, sensor in _groups(rows):
        part = [row for row in rows if (row["family"], row["sensor"]) == (family, sensor)]
        values = [[[row[name] for row in part if row["source"] == source] for source in SOURCES] for name in PROPERTIES]
        lines.append(_line(family, sensor, *(" / ".join(f"{np.median(v):.3g}" if v else "-" for v in both) for both in values)))
    return "\n".join(lines)


def _groups(rows: list[Row]) -> list[tuple[str, str]]:
    return [(family, sensor) for family in dict.fromkeys(str(row["family"]) for row in rows) for sensor in SENSORS]


def _shares(part: list[Row], name: str) -> str:
    return " / ".join(f"{100 * np.mean([row[f'{name} {rule}'] for row in part]):.0f}" for rule in RULES) if part else "-"


def _line(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
