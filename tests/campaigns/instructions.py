"""Count the instructions of a frame under valgrind, and compare them with the recorded ones; Linux only.

    python tests/campaigns/instructions.py [record] [--only TEXT]

Each frame of the budget (tests/test_budget.py) is detected 2 and 4 times under callgrind; half the difference of the two counts
is one frame's, without the start of the program. One process starts and detects twice in each frame, and its forks go on: one
ends, one detects twice more. That takes some minutes. Prints a line per frame; exit code 1 if one takes over 2 % more than
recorded.

Counts depend on the builds of Python, NumPy and the kernels: `instructions.json` holds those of each environment that was
recorded, and in another one the counts are printed only.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from builders.work import NAMES, SURROUNDINGS, versions

FILE = Path(__file__).with_name("instructions.json")
FIRST, MORE = 2, 2
"""Detections in each frame that import and fill caches, and those that are counted."""

TOLERANCE = 1.02
"""Times the recorded count that a frame may take."""

MILLION = 1e6
CALLGRIND = ("valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null")


def detect_in_forks(frames: Path) -> None:
    """Detect in each pickled frame, and print the process ids of its two forks."""
    import doo3d
    from doo3d.runs.threads import single_thread

    single_thread()
    for name, data, mask, preset in pickle.loads(frames.read_bytes()):
        config = doo3d.load_config(preset)
        for _ in range(FIRST):
            doo3d.detect(data, config, mask)
        forks = []
        for detections in (0, MORE):
            fork = os.fork()
            if fork == 0:
                for _ in range(detections):
                    doo3d.detect(data, config, mask)
                os._exit(0)
            os.waitpid(fork, 0)
            forks.append(fork)
        print(json.dumps([name, *forks]), flush=True)


def count(only: str) -> dict[str, float]:
    """Return the millions of instructions of each frame whose name holds `only`."""
    from doo3d.tools.bench_cases import CASES

    cases = [(case, case.make()) for case in CASES if case.name in NAMES and only in case.name]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frames.pkl"
        path.write_bytes(pickle.dumps([(case.name, made.data, made.mask, case.preset or "default") for case, made in cases]))
        command = [*CALLGRIND, sys.executable, __file__, "--frames", str(path)]
        done = subprocess.run(command, env=SURROUNDINGS, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}: {done.stderr}")
    collected = {int(process): int(value) for process, value in re.findall(r"==(\d+)== Collected : (\d+)", done.stderr)}
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    return {name: round((collected[many] - collected[few]) / MORE / MILLION, 3) for name, few, many in rows}


def above(found: dict[str, float], recorded: dict[str, float]) -> list[str]:
    """Return a sentence for each frame that takes over 2 % more instructions than recorded."""
    return [
        f"{name}: {100 * (value / recorded[name] - 1):.1f} % more than the recorded {recorded[name]:.1f}"
        for name, value in found.items()
        if name in recorded and value > TOLERANCE * recorded[name]
    ]


def main(arguments: list[str] | None = None) -> int:
    """Count, and compare or record; 1 where a frame takes more than recorded."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", nargs="?", choices=("compare", "record"), default="compare")
    parser.add_argument("--only", default="", metavar="TEXT", help="only frames whose names hold TEXT")
    parser.add_argument("--frames", type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    if chosen.frames:
        detect_in_forks(chosen.frames)
        return 0
    if shutil.which(CALLGRIND[0]) is None:
        print("no instructions are counted: valgrind is not installed, which Linux has as a package")
        return 0
    found = count(chosen.only)
    for name, value in found.items():
        print(f"{name}: {value:.1f} million instructions")
    known: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    here = f"{versions()}, {platform.python_compiler()}, {' '.join(platform.libc_ver())}"
    if chosen.action == "record":
        known[here] = known.get(here, {}) | found
        FILE.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8", newline="\n")
        return 0
    if here not in known:
        print(f"nothing is compared: {FILE.name} has no counts of this environment, which are\n{json.dumps({here: found})}")
        return 0
    sentences = above(found, known[here])
    for sentence in sentences:
        print(sentence)
    return int(bool(sentences))


if __name__ == "__main__":
    sys.exit(main())
