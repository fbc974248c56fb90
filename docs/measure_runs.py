"""Measure the speed of runs and their survival of kills: python docs/measure_runs.py [--frames 100] [--kills 20].

Run it in the folder that holds sample_clouds/. The capture repeats rendered frames of 1280x720 (sample_clouds/crossing and
two_cables).
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
    """Write a capture of repeated sample frames."""
    for part, suffix in (("color", "jpg"), ("depth", "png")):
        (folder / part).mkdir(parents=True)
        for i in range(frames):
            sample, name = SCENES[i % len(SCENES)]
            shutil.copy(sample / part / f"{name}.{suffix}", folder / part / f"{i:06d}.{suffix}")
    shutil.copy(SCENES[0][0] / "camera_intrinsic.json", folder)


def command(capture: Path, out: Path, workers: int) -> list[str]:
    """Return the command of a run."""
    return [sys.executable, "-m", "doo3d", "detect", str(capture), "-o", str(out), "--workers", str(workers), "--quiet"]


def contents(out: Path) -> dict[str, bytes]:
    """Return the files of a run, without the journal, which holds times."""
    return {file.name: file.read_bytes() for file in out.iterdir() if file.name != "progress.jsonl"}


def timed(capture: Path, out: Path, workers: int) -> float:
    """Return the seconds of a run."""
    start = time.perf_counter()
    subprocess.run(command(capture, out, workers), check=True)
    return time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--kills", type=int, default=20)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        write_capture(folder / "capture", options.frames)
        seconds = {workers: timed(folder / "capture", folder / f"out{workers}", workers) for workers in (0, 1, 2)}
        lines = (folder / "out0" / "progress.jsonl").read_text().splitlines()
        frame_seconds = sum(json.loads(line)["seconds"] for line in lines)
        for workers, total in seconds.items():
            print(f"--workers {workers}: {total:.1f} s, {options.frames / total:.1f} frames/s")
        print(f"two workers against one: {seconds[1] / seconds[2]:.2f} times")
        overhead = 100 * (seconds[0] / frame_seconds - 1)
        print(f"overhead of --workers 0 over the times of its frames: {overhead:.1f} % (start included)")
        expected = contents(folder / "out0")
        same = [contents(folder / f"out{workers}") == expected for workers in (1, 2)]
        print(f"byte-equal: {sum(same)} of {len(same)}")
        survived, rng = 0, random.Random(0)
        for k in range(options.kills):
            out, workers = folder / f"killed{k}", (0, 2)[k % 2]
            process = subprocess.Popen(command(folder / "capture", out, workers), env=os.environ)
            time.sleep(rng.uniform(0.5, seconds[workers]))
            process.kill()
            process.wait()
            subprocess.run(command(folder / "capture", out, workers), check=True)
            survived += contents(out) == expected
            shutil.rmtree(out)
        print(f"killed at a random moment and resumed: byte-equal {survived} of {options.kills}")


if __name__ == "__main__":
    main()
