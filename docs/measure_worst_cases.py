"""Measure time and memory of the worst cases: python docs/measure_worst_cases.py [--only WORD ...] [--views VIEW ...].

Run it in the root folder of the repository. Each case is one detection, at 1280x720 unless its name says
another size, in a process of its own with one thread. Printed are the CPU seconds of the detection, the memory that it took
beyond the input in MB, the chains, and the first note.
"""

import argparse
import json
import os
import resource
import signal
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
SIZE = (1280, 720)
TIMEOUT_S = 200
WAITS = 10
MEMORY_LIMIT_BYTES = 8 << 30
VIEWS = ("image", "paper_2d", "flat depth", "random depth", "harness", "harness image", "cloud", "random cloud", "harness cloud")
PRESETS = {"image": "image", "paper_2d": "paper_2d", "harness": "harness", "harness image": "image"}
NOTE_LENGTH = 120
NOISE = "photograph of noise"
os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def case_of(kind: str, view: str, size: tuple[int, int]) -> tuple[object, object, object]:
    """Return data, settings and mask of a case."""
    from builders import worst_cases, worst_clouds

    import doo3d

    overrides: dict[str, object] = {"segment.method": "everything"} if view.endswith("cloud") else {}
    overrides |= {"merge.branches": True} if view.startswith("harness") else {}
    config = doo3d.load_config(PRESETS.get(view, "default"), overrides)
    if kind in worst_clouds.CLOUDS:
        return doo3d.Cloud(worst_clouds.CLOUDS[kind]()), config, None
    if kind.startswith(NOISE):
        size = (100_000, 16) if kind.endswith("x16") else (4096, 4096) if kind.endswith("4096") else size
        color = worst_cases.noise_image(size)
        if config.mode == "2d":
            return worst_cases.Image(color), config, None
        frame = worst_cases.frame_of_mask(worst_cases.salt_and_pepper(size, 0.5), view.startswith("random"))
        return doo3d.Frame(color, frame.depth, frame.camera), config, None
    make, size = worst_cases.LARGE.get(kind, (worst_cases.MASKS.get(kind), size))
    mask = make(size)
    if config.mode == "2d":
        return worst_cases.image_of(mask), config, mask
    frame = worst_cases.frame_of_mask(mask, view.startswith("random"))
    return (worst_cases.cloud_of(frame, mask), config, None) if view.endswith("cloud") else (frame, config, mask)


def memory_mb(entry: str) -> float:
    """Return the memory of this process in MB: VmRSS now, VmHWM at most so far (Linux)."""
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(lines[entry].split()[0]) / 1024


def detect_case(kind: str, view: str, size: tuple[int, int]) -> dict:
    """Detect one case in this process, and return its figures."""
    import doo3d

    data, config, mask = case_of(kind, view, size)
    Path("/proc/self/clear_refs").write_text("5")  # the largest memory counts from here on
    before = memory_mb("VmRSS")
    start = time.process_time()
    try:
        detection = doo3d.detect(data, config, mask=mask)
        found = {"chains": len(detection.chains), "note": " | ".join(detection.notes), "stages": detection.seconds}
    except doo3d.InputError as error:
        found = {"chains": 0, "note": str(error), "stages": {}}
    seconds = time.process_time() - start
    return found | {"seconds": seconds, "mb": memory_mb("VmHWM") - before}


def cases() -> list[tuple[str, str]]:
    """Return kind and view of every case."""
    from builders import worst_cases, worst_clouds

    frames = [view for view in VIEWS if not view.endswith("cloud")]
    result = [(kind, view) for kind in worst_cases.MASKS for view in VIEWS if view != "harness cloud"]
    result += [(NOISE, view) for view in frames]
    result += [(f"{NOISE}, {size}", view) for size in ("100000x16", "4096x4096") for view in ("image", "flat depth")]
    result += [(kind, view) for kind in worst_cases.LARGE for view in ("image", "flat depth", "harness")]
    return result + [(kind, view) for kind in worst_clouds.CLOUDS for view in ("cloud", "harness cloud")]


def measure(kind: str, view: str, timeout: int) -> dict | str:
    """Detect one case in a process of its own, forked from this one; return its figures, or how it failed."""
    read_end, write_end = os.pipe()
    child = os.fork()
    if not child:
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (timeout, timeout + 1))
        signal.alarm(WAITS * timeout)  # a process that waits for something takes no CPU
        try:
            found: dict | str = detect_case(kind, view, SIZE)
        except Exception as error:
            found = f"{type(error).__name__}: {error}"
        os.write(write_end, json.dumps(found).encode())
        os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        answer = pipe.read()
    status = os.waitpid(child, 0)[1]
    if answer:
        return json.loads(answer)
    over = {signal.SIGXCPU: f"over {timeout} s", signal.SIGALRM: f"waits for more than {WAITS * timeout} s"}
    return over.get(os.WTERMSIG(status), f"ended by signal {os.WTERMSIG(status)}")


def warm_up() -> None:
    """Import what detection needs, once for all cases."""
    import cv2
    from builders.worst_cases import frame_of_mask, image_of, lines

    import doo3d

    cv2.setNumThreads(1)
    mask = lines((320, 180), 60, 7)
    doo3d.detect(frame_of_mask(mask, False), "harness", mask=mask)
    doo3d.detect(image_of(mask), "image", mask=mask)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", nargs="*", default=[""], help="kinds with one of these words in their name")
    parser.add_argument("--views", nargs="*", default=VIEWS, choices=VIEWS)
    parser.add_argument("--timeout", type=int, default=TIMEOUT_S, help="CPU seconds of a case at most")
    parser.add_argument("--stages", action="store_true", help="print the slowest stages too")
    options = parser.parse_args()
    warm_up()
    for kind, view in cases():
        if view not in options.views or not any(word in f"{kind}, {view}" for word in options.only):
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
