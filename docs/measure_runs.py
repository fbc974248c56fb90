"""Measure runs: their speed and overhead, their survival of kills, and their memory over many frames.

    python docs/measure_runs.py [--frames 200] [--kills 20]     # speed, overhead, kills
    python docs/measure_runs.py --flat 10000                    # memory

Run it in the folder that holds sample_clouds/. The capture repeats rendered frames of 1280x720 (sample_clouds/crossing and
two_cables); for the memory, every third pixel of a part of sample_clouds/crossing, 64x48. `--flat` needs Linux.
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

DOO3D = str(Path(sys.executable).with_name("doo3d"))  # the command beside this Python, not the sources beside this script

SAMPLES = Path("sample_clouds")
SCENES = [(SAMPLES / "crossing", f"{i:06d}") for i in range(3)] + [(SAMPLES / "two_cables", "000000")]
SMALL = (64, 48)  # px
CORNER, STEP = (490, 329), 3  # px, of the small frames in the sample: two pieces of the cable
FLAT_AT = (0.1, 0.5, 1.0)  # of the frames


def write_capture(folder: Path, frames: int) -> None:
    """Write a capture of repeated sample frames."""
    for part, suffix in (("color", "jpg"), ("depth", "png")):
        (folder / part).mkdir(parents=True)
        for i in range(frames):
            sample, name = SCENES[i % len(SCENES)]
            shutil.copy(sample / part / f"{name}.{suffix}", folder / part / f"{i:06d}.{suffix}")
    shutil.copy(SCENES[0][0] / "camera_intrinsic.json", folder)


def write_small_capture(folder: Path, frames: int) -> None:
    """Write a capture of many small frames, all the same."""
    import cv2

    sample, name = SCENES[0]
    camera = json.loads((sample / "camera_intrinsic.json").read_text())
    matrix = camera["intrinsic_matrix"]  # column by column
    matrix[0], matrix[4] = matrix[0] / STEP, matrix[4] / STEP
    matrix[6:8] = [(center - corner) / STEP for center, corner in zip(matrix[6:8], CORNER, strict=True)]
    (top, height), (left, width) = zip(CORNER[::-1], SMALL[::-1], strict=True)
    window = (slice(top, top + STEP * height, STEP), slice(left, left + STEP * width, STEP))
    for part, suffix in (("color", "jpg"), ("depth", "png")):
        (folder / part).mkdir(parents=True)
        image = cv2.imread(str(sample / part / f"{name}.{suffix}"), cv2.IMREAD_UNCHANGED)
        first = folder / part / f"{0:06d}.{suffix}"
        cv2.imwrite(str(first), image[window])
        for i in range(1, frames):
            os.link(first, folder / part / f"{i:06d}.{suffix}")
    small = {"width": SMALL[0], "height": SMALL[1], "intrinsic_matrix": matrix}
    (folder / "camera_intrinsic.json").write_text(json.dumps(camera | small))


def command(capture: Path, out: Path, workers: int) -> list[str]:
    """Return the command of a run. All chains are kept: small frames show pieces too short to be sure of."""
    kept = ["--set", "output.min_confidence=0"]
    return [DOO3D, "detect", str(capture), "-o", str(out), "--workers", str(workers), "--quiet", *kept]


def contents(out: Path) -> dict[str, bytes]:
    """Return the files of a run, without the journal, which holds times."""
    return {file.name: file.read_bytes() for file in out.iterdir() if file.name != "progress.jsonl"}


def timed(capture: Path, out: Path, workers: int) -> tuple[float, float]:
    """Return the seconds of a run, and those of processors, of all its processes."""
    start, before = time.perf_counter(), os.times()
    subprocess.run(command(capture, out, workers), check=True)
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - start, used


def frame_seconds(out: Path) -> float:
    """Return the sum of the times of a run's frames, s."""
    return sum(json.loads(line)["seconds"] for line in (out / "progress.jsonl").read_text().splitlines())


def measure_speed(folder: Path, frames: int, kills: int) -> None:
    """Print how long runs take, what they add to their frames' times, and whether they survive kills."""
    write_capture(folder / "one", 1)
    write_capture(folder / "capture", frames)
    starting, seconds = {}, {}
    for workers in (0, 1, 2):
        alone, _ = timed(folder / "one", folder / f"one{workers}", workers)
        starting[workers] = alone - frame_seconds(folder / f"one{workers}")
        out = folder / f"out{workers}"
        seconds[workers], used = timed(folder / "capture", out, workers)
        work = frame_seconds(out)
        speed = f"{seconds[workers]:.1f} s, {frames / seconds[workers]:.1f} frames/s"
        each = f"{1000 * work / frames:.0f} ms a frame, {1000 * used / frames:.0f} ms of processors"
        print(f"--workers {workers}: {speed}; starting {starting[workers]:.1f} s, {each}")
    print(f"two workers against one: {seconds[1] / seconds[2]:.2f} times, start included; ", end="")
    print(f"{(seconds[1] - starting[1]) / (seconds[2] - starting[2]):.2f} times past it")
    work = frame_seconds(folder / "out0")
    overhead = 100 * ((seconds[0] - starting[0]) / work - 1)
    print(f"overhead of --workers 0 over the times of its frames, past starting: {overhead:.1f} %")
    expected = contents(folder / "out0")
    same = [contents(folder / f"out{workers}") == expected for workers in (1, 2)]
    print(f"byte-equal: {sum(same)} of {len(same)}")
    survived, rng = 0, random.Random(0)
    for k in range(kills):
        out, workers = folder / f"killed{k}", (0, 2)[k % 2]
        process = subprocess.Popen(command(folder / "capture", out, workers))
        time.sleep(rng.uniform(0.5, seconds[workers]))
        process.kill()
        process.wait()
        subprocess.run(command(folder / "capture", out, workers), check=True)
        survived += contents(out) == expected
        shutil.rmtree(out)
    print(f"killed at a random moment and resumed: byte-equal {survived} of {kills}")


def resident(process: int) -> list[float]:
    """Return the memory in use, MB, by a process and by each process that it started and that works."""
    family = [process] + [int(child) for child in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    megabytes = []
    for each in family:
        fields = dict(line.split(":", 1) for line in Path(f"/proc/{each}/status").read_text().splitlines())
        megabytes.append(int(fields["VmRSS"].split()[0]) / 1024 if "VmRSS" in fields else 0.0)
    return [value for value in megabytes if value > 50]  # not the tracker of multiprocessing's resources


def measure_memory(folder: Path, frames: int) -> None:
    """Print the memory of a run of small frames as it goes on; it has 1 % more of them, so that its workers are seen working."""
    total = frames + max(frames // 100, 20)
    write_small_capture(folder / "capture", total)
    for workers in (0, 2):
        out = folder / f"out{workers}"
        journal = out / "progress.jsonl"
        process = subprocess.Popen(command(folder / "capture", out, workers))
        done, position = 0, 0
        for share in FLAT_AT:
            while done < int(share * frames) and process.poll() is None:
                time.sleep(0.02)
                if journal.exists():
                    with journal.open("rb") as file:
                        file.seek(position)
                        new = file.read()
                    done, position = done + new.count(b"\n"), position + len(new)
            memory = " + ".join(f"{value:.0f}" for value in resident(process.pid))
            print(f"--workers {workers}: {memory} MB after {done} frames of {SMALL[0]}x{SMALL[1]}", flush=True)
        process.wait()
        counts = json.loads((out / "manifest.json").read_text())["counts"]
        print(f"--workers {workers}: {counts}, {frame_seconds(out) / total * 1000:.1f} ms a frame")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--flat", type=int, metavar="FRAMES", help="measure the memory of a run of so many small frames instead")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        if options.flat:
            measure_memory(Path(temporary), options.flat)
        else:
            measure_speed(Path(temporary), options.frames, options.kills)


if __name__ == "__main__":
    main()
