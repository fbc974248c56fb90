"""What a run costs and survives: python docs/measure_runs.py [--frames 100] [--kills 20]; run where sample_clouds/ is.

The capture is rendered frames of 1280x720 (sample_clouds/crossing and two_cables), again and again.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SAMPLES = Path("sample_clouds")
SCENES = [(SAMPLES / "crossing", f"{i:06d}") for i in range(3)] + [(SAMPLES / "two_cables", "000000")]


def write_capture(folder: Path, frames: int) -> None:
    for part, suffix in (("color", "jpg"), ("depth", "png")):
        (folder / part).mkdir(parents=True)
        for i in range(frames):
            sample, name = SCENES[i % len(SCENES)]
            shutil.copy(sample / part / f"{name}.{suffix}", folder / part / f"{i:06d}.{suffix}")
    shutil.copy(SCENES[0][0] / "camera_intrinsic.json", folder)


def command(capture: Path, out: Path, workers: int, *more: str) -> list[str]:
    line = [sys.executable, "-m", "doo3d", "detect", str(capture), "-o", str(out), "--workers", str(workers), *more]
    return [*line, "--quiet"]


def contents(out: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in out.iterdir() if file.name != "progress.jsonl"}


def timed(capture: Path, out: Path, workers: int) -> float:
    start = time.perf_counter()
    subprocess.run(command(capture, out, workers), check=True)
    return time.perf_counter() - start


def main() -> None:
    ask = argparse.ArgumentParser()
    ask.add_argument("--frames", type=int, default=100)
    ask.add_argument("--kills", type=int, default=20)
    asked = ask.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        write_capture(folder / "capture", asked.frames)
        seconds = {workers: timed(folder / "capture", folder / f"out{workers}", workers) for workers in (0, 1, 2)}
        lines = (folder / "out0" / "progress.jsonl").read_text().splitlines()
        own = sum(json.loads(line)["seconds"] for line in lines)
        for workers, taken in seconds.items():
            print(f"--workers {workers}: {taken:.1f} s, {asked.frames / taken:.1f} frames/s")
        print(f"two workers against one: {seconds[1] / seconds[2]:.2f} times")
        print(f"overhead of --workers 0 over the frames' own times: {100 * (seconds[0] / own - 1):.1f} % (starting included)")
        wanted = contents(folder / "out0")
        same = [contents(folder / f"out{workers}") == wanted for workers in (1, 2)]
        print(f"byte-equal: {sum(same)} of {len(same)}")
        survived, draw = 0, random.Random(0)
        for k in range(asked.kills):
            out, workers = folder / f"killed{k}", (0, 2)[k % 2]
            process = subprocess.Popen(command(folder / "capture", out, workers), env=os.environ)
            time.sleep(draw.uniform(0.5, seconds[workers]))
            process.kill()
            process.wait()
            subprocess.run(command(folder / "capture", out, workers), check=True)
            survived += contents(out) == wanted
            shutil.rmtree(out)
        print(f"killed at a random moment and started again: byte-equal {survived} of {asked.kills}")


if __name__ == "__main__":
    main()
