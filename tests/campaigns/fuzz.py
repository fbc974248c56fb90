"""Changed inputs for every reader, and odd arrays for `detect`: each ends in a result or in a sentence.

`python tests/campaigns/fuzz.py --count 10000 --seed 1`. An input is one of `fuzz_seeds`, one file of which is changed as
`fuzz_mutations` does, or arrays of odd shapes, types and values. It fails the campaign if it raises anything but an error of
doo3d, prints a warning of Python, ends the process, takes more than 5 s of CPU time, or more than 2 GB of memory. `--only N`
repeats one input, and leaves its files in the folder that is printed. `--settings` gives each number among the settings values at
its bounds and beyond them, for a frame, a cloud and an image; the limits are the same.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
from fuzz_mutations import mutated
from fuzz_seeds import PINHOLE, points, scene, write_seeds
from fuzz_settings import SETTINGS, one_setting

from doo3d import Camera, Cloud, Detection, Frame, Image, detect, load_config  # loaded once, before processes are forked
from doo3d.config import parse_overrides
from doo3d.errors import DooError, DooWarning
from doo3d.evaluation.truth_file import read_truth
from doo3d.exports import export
from doo3d.guard import isolation
from doo3d.inputs import ReadOptions, open_capture
from doo3d.inputs.formats.trajectory import read_trajectory
from doo3d.inputs.support.camera_files import read_camera_file
from doo3d.inputs.support.pose_file import read_pose
from doo3d.outputs.frame_status import frame_statuses, read_picture
from doo3d.outputs.journal import Journal
from doo3d.outputs.run_identity import read_manifest
from doo3d.outputs.run_reader import open_results

MAX_CPU_SECONDS = 5.0
MAX_BYTES = 2 << 30
LIMIT_BYTES = 4 << 30
"""Memory that the process may take at all, so that a fault does not take the machine's."""

MAX_WALL_SECONDS = 150.0
"""s until a process that gives no answer is ended."""

ARRAYS_SHARE = 0.1
DETECT_SHARE = 0.3
"""Shares of inputs that are arrays, and of readable frames in which chains are detected."""


class Outcome(NamedTuple):
    """The end of one input: what it was, "result", "sentence" or a fault, CPU time in s, and peak memory in bytes."""

    number: int
    what: str
    end: str
    detail: str = ""
    seconds: float = 0.0
    peak: int = 0


class _TooLong(BaseException):
    """Raised in an input that takes too much CPU time."""


def use(path: Path, name: str, random: Random) -> None:
    """Read one input by what it is."""
    text = name.removeprefix("text ")
    if text == name:
        _use_capture(path, name, random)
    else:
        _READERS[text](path)


def _use_capture(path: Path, name: str, random: Random) -> None:
    is_image = name in ("photos", "a.avi") or name.startswith("picture")
    options = ReadOptions(camera=PINHOLE) if name in ("tum", "icl", "redwood", "lerobot") else ReadOptions()
    capture = open_capture(path, is_image, options=options)
    config = load_config("image") if is_image else load_config()
    for frame in capture.frames[:2]:
        loaded = frame.load()
        if random.random() < DETECT_SHARE:
            detect(loaded.data, config, loaded.mask_for(config), None if is_image else loaded.base_pose)


def _use_results(path: Path) -> None:
    Journal(path / "progress.jsonl").read()
    read_manifest(path)
    results = open_results(path)
    for status in frame_statuses(results):
        read_picture(status.picture)
    for detection in results.detections():
        assert isinstance(detection, Detection)
    before = sorted(path.parent.rglob("*"))
    for to in ("csv", "obj", "urdf"):
        export(results, to, path / f"made.{to}" if to == "csv" else path / to, force=True)
    strange = [file for file in path.parent.rglob("*") if file not in before and path not in file.parents]
    assert not strange, f"written outside: {strange}"


def _use_config(path: Path) -> None:
    load_config(path)
    parse_overrides([f"merge.chains={path.read_text(errors='replace')}"])


_READERS: dict[str, Callable[[Path], Any]] = {
    **{"results": _use_results, "mine.yaml": _use_config, "truth.json": read_truth, "trajectory.txt": read_trajectory},
    **dict.fromkeys(("pose.json", "pose.txt", "pose.npy"), read_pose),
    **dict.fromkeys(("opencv.yaml", "realsense.txt"), read_camera_file),
}


def detect_arrays(random: Random) -> str:
    """Detect chains in arrays of odd shapes, types and values; what they were."""
    rng = np.random.default_rng(random.getrandbits(64))
    color, depth, mask = scene(random.random())
    kind = random.choice(("frame", "cloud", "image"))
    settings = random.choice(({}, {"merge.chains": 3}, {"fit.segment_length": 0.001}, {"voxelize.radius": 0.01}))
    metres = _odd(depth.astype(random.choice(("f2", "f4", "f8"))) / 1000, random, rng)
    picture = _odd(color, random, rng) if random.random() < 0.5 else color
    wanted = _odd(mask, random, rng) if random.random() < 0.5 else mask
    if kind == "image":
        detect(Image(picture), load_config("image", settings), wanted)
    elif kind == "frame":
        height, width = metres.shape[:2] if metres.ndim >= 2 else (48, 64)
        pinhole = [value * random.choice((1, 1, 1, 1e-3, 1e3, 1e-300, 1e300)) for value in PINHOLE]
        detect(
            Frame(picture if random.random() < 0.7 else None, metres, Camera(*pinhole, width, height)),
            load_config("default", settings),
            wanted,
        )
    else:
        cloud = _odd(points() * random.choice((1, 1, 1e-9, 1e3, 1e9, 1e150, 1e305)), random, rng)
        detect(Cloud(cloud, viewpoint=random.choice((None, np.zeros(3), np.full(3, 1e300)))), load_config("default", settings))
    return kind


def _odd(array: np.ndarray, random: Random, rng: np.random.Generator) -> np.ndarray:
    """Return an array, changed in shape, type or values."""
    number, is_float = random.randrange(14), array.dtype.kind == "f"
    changes: dict[int, Callable[[], np.ndarray]] = {
        0: lambda: array[: random.choice((0, 1, 2, 3, 4))],
        1: lambda: array[..., None],
        2: lambda: array.astype(random.choice(("i4", "u1", "f8", "c16", "O", "?", "S3"))),
        3: lambda: np.asfortranarray(array)[::-1],
        7: lambda: np.zeros_like(array),
        8: lambda: np.ones_like(array),
        9: lambda: (rng.random(array.shape) if is_float else rng.integers(0, 2, array.shape)).astype(array.dtype),
        10: lambda: np.repeat(array[:1], len(array), axis=0),
        11: lambda: array.ravel(),
    }
    if number in (4, 5, 6) and is_float:
        changed, largest = array.copy(), 1e30 if array.dtype.itemsize > 2 else 6e4
        value = random.choice((np.nan, np.inf, -np.inf, -1, 0, 1e-30, 6e4, largest))
        changed[rng.random(array.shape) < random.choice((0.001, 0.1, 0.9, 1.1))] = value
        return changed
    with np.errstate(invalid="ignore"):
        return changes.get(number, lambda: array)()


def one(number: int, seed: int, seeds: dict[str, Path], work: Path) -> tuple[str, Callable[[], Any]]:
    """Prepare input `number`: what it is, and the function that uses it."""
    random = Random(f"{seed}/{number}")
    if random.random() < ARRAYS_SHARE:
        return "arrays", lambda: detect_arrays(random)
    name = random.choice(sorted(seeds))
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    target = work / seeds[name].name
    if seeds[name].is_dir():
        shutil.copytree(seeds[name], target)
    else:
        shutil.copy(seeds[name], target)
    files = sorted(file for file in target.rglob("*") if file.is_file()) if target.is_dir() else [target]
    file = random.choice(files)
    file.write_bytes(mutated(file.read_bytes(), random))
    return f"{name}: {file.name}", lambda: use(target, name, random)


def judged(number: int, what: str, action: Callable[[], Any]) -> Outcome:
    """Use one input and return how it ended."""
    _forget_peak()
    start = _cpu_seconds()
    end, detail = "result", ""
    try:
        with (
            _limited_time(),
            open(os.devnull, "w") as nothing,
            redirect_stdout(nothing),
            redirect_stderr(nothing),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", category=DooWarning)  # a sentence to the user is no fault
            warnings.filterwarnings("default", category=DeprecationWarning)
            warnings.filterwarnings("default", category=ResourceWarning)
            action()
    except DooError as error:
        text = str(error)
        end, detail = "sentence", text
        if "\n" in text or len(text) > 1500 or not error.code:
            end = f"a sentence of {len(text)} letters, {text.count(chr(10))} line ends"
        if isinstance(error.__cause__, Warning):
            end = "warning"
    except _TooLong:
        end, detail = "too long", traceback.format_exc()
    except BaseException:
        end, detail = "exception", traceback.format_exc()
    seconds, peak = _cpu_seconds() - start, _peak_bytes()
    if end in ("result", "sentence") and seconds > MAX_CPU_SECONDS:
        end = "too long"
    if end in ("result", "sentence") and peak > MAX_BYTES:
        end = "too much memory"
    return Outcome(number, what, end, detail, seconds, peak)


@contextmanager
def _limited_time() -> Iterator[None]:
    def stop(*_: object) -> None:
        raise _TooLong

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, 2 * MAX_CPU_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _processes() -> list[int]:
    """Return this process and that of the native readers."""
    return [os.getpid(), *(process._process.pid for process in isolation._processes.values() if process.is_alive())]


def _cpu_seconds() -> float:
    total = 0.0
    for number in _processes():
        with suppress(OSError):
            fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
            total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def _forget_peak() -> None:
    for number in _processes():
        with suppress(OSError):
            Path(f"/proc/{number}/clear_refs").write_text("5")


def _peak_bytes() -> int:
    total = 0
    for number in _processes():
        with suppress(OSError):
            lines = Path(f"/proc/{number}/status").read_text().splitlines()
            total += sum(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))
    return total


Prepare = Callable[[int], tuple[str, Callable[[], Any]]]
"""Prepares the input of a number: what it is, and the function that uses it."""


def _work(pipe: Connection, numbers: range, prepare: Prepare) -> None:
    """Do inputs one by one in a forked process; each is announced before it begins."""
    import resource

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_DATA, (LIMIT_BYTES, LIMIT_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for number in numbers:
        what, action = prepare(number)
        pipe.send((number, what))
        pipe.send(judged(number, what, action))
    pipe.send(None)


def campaign(numbers: range, prepare: Prepare) -> Iterator[Outcome]:
    """Yield the outcome of each input; a process that ends is replaced."""
    at, step = numbers.start, numbers.step
    while at < numbers.stop:
        here, there = Pipe()
        process = os.fork()
        if process == 0:
            status = 1
            try:
                here.close()
                _work(there, range(at, numbers.stop, step), prepare)
                status = 0
            finally:
                os._exit(status)
        there.close()
        what = "?"
        try:
            while here.poll(MAX_WALL_SECONDS):
                message = here.recv()
                if message is None:
                    at = numbers.stop
                    break
                if isinstance(message, Outcome):
                    yield message
                    at = message.number + step
                else:
                    at, what = message
            else:
                yield Outcome(at, what, "no answer")
                os.kill(process, signal.SIGKILL)
                at += step
        except EOFError:
            yield Outcome(at, what, "ended the process")
            at += step
        here.close()
        os.waitpid(process, 0)


def main() -> int:
    """Run the campaign from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--settings", action="store_true", help="settings at their bounds in place of changed inputs")
    parser.add_argument("--step", type=int, default=1, metavar="N", help="only each Nth input")
    parser.add_argument("--only", type=int, help="number of an input to repeat")
    parser.add_argument("--sentences", action="store_true", help="print an example of each sentence about unforeseen content")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="doo3d_fuzz_"))
    if given.settings:
        prepare, count, name = one_setting, len(SETTINGS), "settings"
    else:
        prepare = partial(one, seed=given.seed, seeds=write_seeds(folder), work=folder / "work" / "input")
        count, name = given.count, f"inputs of seed {given.seed}"
    if given.only is not None:
        what, action = prepare(given.only)
        outcome = judged(given.only, what, action)
        print(folder, *outcome, sep="\n")
        return outcome.end not in ("result", "sentence")
    ends: Counter[str] = Counter()
    unforeseen: dict[str, str] = {}
    faults, slowest, largest, start = [], 0.0, 0, time.monotonic()
    numbers = range(given.first, given.first + count, given.step)
    for outcome in campaign(numbers, prepare):
        ends[outcome.end] += 1
        slowest, largest = max(slowest, outcome.seconds), max(largest, outcome.peak)
        if " at " in outcome.detail and "is not what its format prescribes" in outcome.detail:
            place = outcome.detail.partition("prescribes (")[2].partition(": ")[0]
            unforeseen.setdefault(place, f"{outcome.number} {outcome.what}: {outcome.detail}")
        if outcome.end not in ("result", "sentence"):
            faults.append(outcome)
            shown = outcome.detail.strip().splitlines()
            print(
                f"{outcome.number} {outcome.what}: {outcome.end} ({outcome.seconds:.1f} s, {outcome.peak >> 20} MB)", flush=True
            )
            print("    " + "\n    ".join(shown[-7:]), flush=True)
    shutil.rmtree(folder, ignore_errors=True)
    if given.sentences:
        print(*unforeseen.values(), sep="\n")
    counted = ", ".join(f"{count} {end}" for end, count in ends.most_common())
    print(f"{len(numbers)} {name}: {counted}; the slowest {slowest:.1f} s of CPU, the largest {largest >> 20} MB")
    print(f"{len(unforeseen)} kinds of content met the guard; {time.monotonic() - start:.0f} s")
    return bool(faults)


if __name__ == "__main__":
    raise SystemExit(main())
