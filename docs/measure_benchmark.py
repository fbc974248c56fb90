"""Measure presets of doo3d in the benchmark: python docs/measure_benchmark.py SET OUT PRESET [PRESET ...] [--masks M] [--auto].

SET is a set as `doo3d evaluate predictions` takes it. The predictions of each preset are written to OUT/PRESET as neutral files,
as any program could write them, and scored by that command. The detection is given the mask of SET, but with --auto nothing;
--masks takes masks by color (hsv, for mBEST) or those of a network (for CVF3D-DLO) instead of the labels' foreground. The preset
"components" is no detection: it takes each connected part of the mask for an instance, as a lower bound. The preset "inputs"
writes photographs and masks for another program (NAME.image.png, NAME.mask.png) to OUT/inputs, and scores nothing.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from doo3d import load_config
from doo3d.evaluation.photos.datasets import cset, mbest
from doo3d.evaluation.predictions.frames import frame_cases
from doo3d.evaluation.predictions.photos import photo_cases
from doo3d.outputs.detection_json import dumps
from doo3d.pipeline import detect
from doo3d.runs.threads import single_thread

LEAST_PIXELS = 100
"""Smallest connected part of a mask that counts as an instance."""


def write_inputs(path: Path, image: np.ndarray, mask: np.ndarray) -> None:
    """Write the photograph (RGB) and the mask of one frame for another program."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path.with_name(f"{path.name}.image.png")), cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    cv2.imwrite(str(path.with_name(f"{path.name}.mask.png")), 255 * mask.astype(np.uint8))


def write(path: Path, preset: str, data: object, mask: np.ndarray | None, in_space: bool) -> None:
    """Predict one frame, and write its neutral files beside `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if preset == "components":
        _, labels, stats, _ = cv2.connectedComponentsWithStats(np.asarray(mask).astype(np.uint8))
        labels[(stats[:, cv2.CC_STAT_AREA] < LEAST_PIXELS)[labels]] = 0
    else:
        start = time.perf_counter()
        detection = detect(data, load_config(preset), mask=mask)
        ms = 1e3 * (time.perf_counter() - start)
        chains = [{"points": chain.joints, "radius": chain.radii, "closed": chain.closed} for chain in detection.chains]
        plain = [
            {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in each.items()} for each in chains
        ]
        path.with_name(f"{path.name}.json").write_text(dumps({"chains": plain, "ms": ms}))
        if in_space:
            return
        labels = detection.instance_labels()
    cv2.imwrite(str(path.with_name(f"{path.name}.png")), labels.astype(np.uint16))


def main() -> None:
    """Predict with each preset, and print the scores."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("presets", nargs="+")
    parser.add_argument("--masks", choices=["labels", "hsv", "network"], default="labels", help="masks of photographs")
    parser.add_argument("--auto", action="store_true", help="give the detection no mask")
    options = parser.parse_args()
    single_thread()
    in_space = any(options.data.rglob("*truth.json"))
    photographs = {"labels": photo_cases, "hsv": partial(mbest, masks="hsv"), "network": partial(cset, masks="network")}
    for preset in options.presets:
        for case in frame_cases(options.data) if in_space else photographs[options.masks](options.data):
            known = case.load()
            name = case.name if in_space else f"{case.family}/{case.name}"
            data = known.data if in_space else known.image
            if preset == "inputs":
                write_inputs(options.out / preset / name, known.image, known.mask)
                continue
            write(options.out / preset / name, preset, data, None if options.auto else known.mask, in_space)
        if preset == "inputs":
            continue
        print(f"{preset} in {options.data}", flush=True)
        command = [sys.executable, "-m", "doo3d", "evaluate", "predictions", options.out / preset, "--data", options.data]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
