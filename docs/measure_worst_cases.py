"""Measure time and memory of the worst cases: python docs/measure_worst_cases.py [--only WORD ...] [--views VIEW ...].

Run it in the root folder of the repository. Each case is one detection at 1280x720, in a process of its own with one thread.
Printed are the CPU seconds of the detection, the largest memory of the process in MB, the chains, and the first note.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
SIZE = (1280, 720)
TIMEOUT_S = 200
MEMORY_LIMIT_BYTES = 8 << 30
VIEWS = ("image", "paper_2d", "flat depth", "random depth", "cloud", "random cloud")
NOTE_LENGTH = 120
NOISE = "photograph of noise"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def detect_case(kind: str, view: str, size: tuple[int, int]) -> dict:
    """Detect one case in this process, and return its figures."""
    import cv2
    from builders import worst_cases

    import doo3d

    cv2.setNumThreads(1)
    overrides = {"segment.method": "everything"} if view.endswith("cloud") else {}
    config = doo3d.load_config(view if view in ("image", "paper_2d") else "default", overrides)
    data: object
    if kind == NOISE:
        color = worst_cases.noise_image(size)
        data, mask = worst_cases.Image(color), None
        if config.mode != "2d":
            frame = worst_cases.frame_of_mask(worst_cases.salt_and_pepper(size, 0.5), view.startswith("random"))
            data = doo3d.Frame(color, frame.depth, frame.camera)
    else:
        mask = worst_cases.MASKS[kind](size)
        data = worst_cases.image_of(mask)
        if config.mode != "2d":
            data = worst_cases.frame_of_mask(mask, view.startswith("random"))
            if view.endswith("cloud"):
                data, mask = worst_cases.cloud_of(data, mask), None
    start = time.process_time()
    try:
        detection = doo3d.detect(data, config, mask=mask)
        found = {"chains": len(detection.chains), "note": " | ".join(detection.notes), "stages": detection.seconds}
    except doo3d.InputError as error:
        found = {"chains": 0, "note": str(error), "stages": {}}
    seconds = time.process_time() - start
    return found | {"seconds": seconds, "mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}


def measure(kind: str, view: str, timeout: float) -> dict | str:
    """Detect one case in a process of its own; return its figures, or how it failed."""
    command = [sys.executable, __file__, "--case", kind, view]
    environment = os.environ | dict.fromkeys(THREADS, "1")
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, env=environment)
    except subprocess.TimeoutExpired:
        return f"over {timeout:g} s"
    if done.returncode:
        return (done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1]
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", nargs="*", default=[""], help="kinds with one of these words in their name")
    parser.add_argument("--views", nargs="*", default=VIEWS, choices=VIEWS)
    parser.add_argument("--timeout", type=float, default=TIMEOUT_S)
    parser.add_argument("--stages", action="store_true", help="print the slowest stages too")
    parser.add_argument("--case", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.case:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))
        print(json.dumps(detect_case(*options.case, SIZE)))
        return
    from builders.worst_cases import MASKS

    for kind in (*MASKS, NOISE):
        if not any(word in kind for word in options.only):
            continue
        for view in options.views:
            if kind == NOISE and view.endswith("cloud"):
                continue
            found = measure(kind, view, options.timeout)
            if isinstance(found, str):
                print(f"| {kind} | {view} | {found} |", flush=True)
                continue
            slowest = sorted(found["stages"].items(), key=lambda item: -item[1])[:3] if options.stages else []
            extra = " ".join(f"{name} {seconds:.1f}" for name, seconds in slowest)
            figures = f"{found['seconds']:.1f} s | {found['mb']:.0f} MB | {found['chains']}"
            print(f"| {kind} | {view} | {figures} | {found['note'][:NOTE_LENGTH]} {extra}", flush=True)


if __name__ == "__main__":
    main()
