"""Count frames without a cable that show a chain: python docs/measure_without_cable.py [--data DIR] [--csv FILE].

The frames: 30 rendered scenes without a cable (even seeds by the simulated D435, odd ones by stereo), the 17 frames of an
office in DIR/device_files/tum_unsorted (depth in millimetres, and again as read with nothing given), and up to 13 photographs
of DIR/cset, mbest, photos and zed_pairs, cut down to a part without a labelled pixel. The rendered scenes and the office are
also measured as photographs alone. Nothing is given. Data that is absent is left out. Printed is the number of frames of each
group with a chain above each confidence.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from doo3d import Image, load_config, open_capture
from doo3d.evaluation.photos.free_crops import free_rectangle
from doo3d.evaluation.rendering.renderer import render
from doo3d.evaluation.scenes.registry import GROUPS, make_scene
from doo3d.inputs.capture import FrameRef
from doo3d.inputs.read_options import ReadOptions
from doo3d.pipeline import detect_with_stages
from doo3d.stages.segment.methods import resolve_method
from doo3d.types import Frame
from doo3d.viz import draw

RENDERS, PHOTOGRAPHS = 30, 13
SENSORS = ("d435", "stereo")
CONFIDENCES = (0.0, *(round(0.05 * k, 2) for k in range(1, 20)))
COUNTED = ("rendered", "office", "photographs")
"""The groups that make up the 60 frames."""

OFFICE_CABLES_PX = 110
"""px from the left border of the office's frames, where cables lie on a desk; they are cut off."""

UNLABELLED = ("img_00", "img_02", "img_08")
"""Photographs of zed_pairs that show cables on the floor, which no mask names."""


@dataclass(frozen=True)
class Case:
    """A frame without a cable: its group, its name, and how to get it."""

    group: str
    name: str
    load: Callable[[], Frame | Image]


def rendered_cases(count: int) -> Iterator[Case]:
    """List rendered scenes, family after family with one seed each, then the next seed."""
    families = GROUPS["without"]
    for k in range(count):
        family, seed = families[k % len(families)], k // len(families)
        sensor = SENSORS[seed % 2]
        yield Case("rendered", f"{family}_{seed:03d}_{sensor}", partial(_render, family, seed, sensor))


def _render(family: str, seed: int, sensor: str) -> Frame:
    return render(make_scene(family, seed), sensor).frame


def office_cases(folder: Path) -> Iterator[Case]:
    """List the frames of the office at the right scale, and as read with nothing given."""
    if not folder.is_dir():
        return
    for group, options in (("office", ReadOptions(depth_scale=1000)), ("office, unit not given", ReadOptions())):
        for ref in open_capture(folder, options=options).frames:
            yield Case(group, ref.name, partial(_office, ref))


def _office(ref: FrameRef) -> Frame:
    """Return a frame of the office without its left part, where cables lie."""
    frame, cut = ref.load().data, OFFICE_CABLES_PX
    camera = replace(frame.camera, cx=frame.camera.cx - cut, width=frame.camera.width - cut)
    return replace(frame, color=frame.color[:, cut:].copy(), depth=frame.depth[:, cut:].copy(), camera=camera)


def photograph_cases(data: Path, count: int) -> Iterator[Case]:
    """List parts of photographs without a cable, of one data set after the other in turn."""
    made = [
        _parts(data, *each)
        for each in (("zed_pairs", "img_??.png"), ("photos", "images/*"), ("cset", "images/*"), ("mbest", "*/images/*"))
    ]
    while made and count:
        case = next(made[0], None)
        made = [*made[1:], made[0]] if case is not None else made[1:]
        if case is not None:
            count -= 1
            yield case


def _parts(data: Path, name: str, pattern: str) -> Iterator[Case]:
    for path in sorted((data / name).glob(pattern)):
        if path.stem in UNLABELLED:
            continue
        color = cv2.imread(str(path))[:, :, ::-1]
        label = _label_path(path)
        mask = None if label is None else cv2.imread(str(label)).any(axis=2)
        if mask is None:
            continue
        color = color[:, : color.shape[1] // 2] if name == "zed_pairs" else color
        if mask.shape != color.shape[:2]:
            mask = cv2.resize(mask.astype(np.uint8), color.shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0
        part = free_rectangle(mask)
        if part is not None:
            yield Case(
                "photographs", f"{name}_{path.parent.parent.name}_{path.stem}", partial(Image, np.ascontiguousarray(color[part]))
            )


def _label_path(image: Path) -> Path | None:
    """Return the image of the labelled pixels of a photograph; None if there is none."""
    names = [image.parent / f"{image.stem}_left_mask_0.png"]
    names += [image.parents[1] / folder / f"{image.stem}.png" for folder in ("labels", "masks")]
    return next((name for name in names if name.is_file()), None)


def as_photograph(case: Case) -> Case:
    """Return the case without its depth."""
    return Case(f"{case.group}, colour alone", case.name, lambda: Image(case.load().color, case.name))


def measure(case: Case, pictures: Path | None) -> list[dict[str, object]]:
    """Detect in a frame with nothing given; return a row for each chain, and draw the chains."""
    data = case.load()
    config = load_config("image" if isinstance(data, Image) else "default")
    detection, stages = detect_with_stages(data, config, None)
    if pictures is not None and detection.chains:
        pictures.mkdir(parents=True, exist_ok=True)
        both = np.concatenate((data.color, draw(data, detection)), axis=1)
        cv2.imwrite(str(pictures / f"{case.group.replace(', ', '_').replace(' ', '_')}_{case.name}.png"), both[:, :, ::-1])
    method = resolve_method(data, config.segment)
    rows = []
    for k, (chain, evidence) in enumerate(zip(detection.chains, stages.evidence, strict=True)):
        start, middle, end = (chain.joints[j] for j in (0, len(chain.joints) // 2, -1))
        pixels = [data.camera.project(p[None])[0] if isinstance(data, Frame) else p for p in (start, middle, end)]
        where = {name: " ".join(f"{x:.0f}" for x in p[:2]) for name, p in zip(("start", "middle", "end"), pixels, strict=True)}
        shape = {"length": chain.length, "radius": chain.radius, "occluded": float(chain.occluded.mean()), "closed": chain.closed}
        known = {"group": case.group, "frame": case.name, "method": method, "chain": k, "chains": len(detection.chains)}
        rows.append(known | shape | asdict(evidence) | where | {"confidence": chain.confidence})
    return rows


def table(counts: dict[str, list[float]]) -> str:
    """Return the number of frames with a chain above each confidence, a line for each group.

    counts : group -> the highest confidence of a chain in each of its frames, -1 without a chain.
    """
    wide = max(map(len, counts))
    lines = [f"{'chain above':{wide}s} frames " + " ".join(f"{each:4.2f}" for each in CONFIDENCES)]
    for group, highest in counts.items():
        numbers = " ".join(f"{sum(each > least for each in highest):4d}" for least in CONFIDENCES)
        lines.append(f"{group:{wide}s} {len(highest):6d} {numbers}")
    return "\n".join(lines)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path("data"), help="folder of the data sets")
    parser.add_argument("--renders", type=int, default=RENDERS, help="number of rendered scenes")
    parser.add_argument("--csv", type=Path, help="write a line per chain to this file")
    parser.add_argument("--pictures", type=Path, help="draw the frames with chains into this folder")
    parser.add_argument("--only", help="measure only the groups whose name begins so")
    options = parser.parse_args()
    cases = [*rendered_cases(options.renders), *office_cases(options.data / "device_files" / "tum_unsorted")]
    cases += [as_photograph(case) for case in cases if case.group in COUNTED]
    cases += photograph_cases(options.data, PHOTOGRAPHS)
    rows, counts = list[dict[str, object]](), dict[str, list[float]]()
    for case in cases:
        if options.only and not case.group.startswith(options.only):
            continue
        found = measure(case, options.pictures)
        print(f"{case.group:28s} {case.name:32s} {len(found)} chains", flush=True)
        rows += found
        counts.setdefault(case.group, []).append(max((float(str(row["confidence"])) for row in found), default=-1.0))
    counted = [each for group in COUNTED for each in counts.get(group, [])]
    print(table(counts | {f"the {len(counted)} frames": counted}))
    if options.csv and rows:
        with options.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
